//! Reads the recording of a game, `game.zip`.

use super::{
    files::{
        GAME_FILE, MOTION_FILE, OUTCOME_FILE, RALLIES_FILE, entries_file, log_file, steps_file,
    },
    table::GameTable,
};
use crate::{
    dataset::Container,
    digest,
    error::DatasetError,
    files::{ARCHIVE_FILE, CALIBRATION_FILE, MANIFEST_FILE, RESULTS_FILE},
};
use arrow_schema::Schema;
use faceoff_scoring::tournament::GameScore;
use faceoff_types::{GameOutcome, Side};
use faceoff_wire::{
    dataset::FileDigest,
    game::{GAME_SCHEMA, GAME_SIDE_SCHEMA, GameManifest},
};
use fs_err as fs;
use serde::Deserialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// All files of a recording except its manifest.
pub(super) const FILES: [&str; 11] = [
    MOTION_FILE,
    RALLIES_FILE,
    steps_file(Side::First),
    entries_file(Side::First),
    log_file(Side::First),
    steps_file(Side::Second),
    entries_file(Side::Second),
    log_file(Side::Second),
    OUTCOME_FILE,
    RESULTS_FILE,
    CALIBRATION_FILE,
];

/// The recording of a game whose files match its manifest.
#[derive(Debug)]
pub struct GameRecording {
    path: PathBuf,
    container: Container,
    manifest: GameManifest,
}

/// The field that all manifests have.
#[derive(Deserialize)]
struct ManifestSchema {
    schema: String,
}

impl GameRecording {
    /// Is there a recording of a game or a side's archive at `path`, by its manifest? The recording may still be invalid.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if a folder holds a game and an evaluation.
    pub fn is_at(path: &Path) -> Result<bool, DatasetError> {
        if path.is_dir() && !path.join(MANIFEST_FILE).exists() {
            let [game, evaluation] = [GAME_FILE, ARCHIVE_FILE].map(|name| path.join(name).exists());
            return match (game, evaluation) {
                (true, true) => Err(DatasetError::Unreadable(format!(
                    "{} holds {GAME_FILE} and {ARCHIVE_FILE}: pass one of them",
                    path.display()
                ))),
                (game, _) => Ok(game),
            };
        }
        let container = if path.is_dir() {
            Container::Folder(path.to_owned())
        } else {
            match Container::archive(path) {
                Ok(container) => container,
                Err(_) => return Ok(false),
            }
        };
        let schema = container.bytes(MANIFEST_FILE).ok();
        let schema = schema.and_then(|bytes| serde_json::from_slice::<ManifestSchema>(&bytes).ok());
        Ok(schema.is_some_and(|manifest| manifest.schema.starts_with("faceoff-game")))
    }

    /// Opens `game.zip`, an unpacked folder, or a folder with a `game.zip`, and compares every file with its hash, so that
    /// a damaged or truncated recording is never partly read.
    ///
    /// # Errors
    /// [`DatasetError`].
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let (path, container) = locate(path)?;
        let manifest = read_manifest(&container)?;
        check_files(&container, &manifest.files, &FILES)?;
        Ok(Self {
            path,
            container,
            manifest,
        })
    }

    /// The recording's manifest.
    #[must_use]
    pub const fn manifest(&self) -> &GameManifest {
        &self.manifest
    }

    /// Size and hash of the archive, which is read completely; `None` for an unpacked folder.
    ///
    /// # Errors
    /// [`DatasetError::Io`].
    pub fn archive(&self) -> Result<Option<FileDigest>, DatasetError> {
        match &self.container {
            Container::Folder(_) => Ok(None),
            Container::Archive { .. } => Ok(Some(digest::of_file(&self.path)?)),
        }
    }

    /// The published score.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `results.json` has another format.
    pub fn results(&self) -> Result<GameScore, DatasetError> {
        serde_json::from_slice(&self.bytes(RESULTS_FILE)?)
            .map_err(DatasetError::unreadable(RESULTS_FILE))
    }

    /// The outcome of the game.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if `outcome.json` has another format.
    pub fn outcome(&self) -> Result<GameOutcome, DatasetError> {
        serde_json::from_slice(&self.bytes(OUTCOME_FILE)?)
            .map_err(DatasetError::unreadable(OUTCOME_FILE))
    }

    pub(super) fn bytes(&self, name: &str) -> Result<Vec<u8>, DatasetError> {
        self.container.bytes(name)
    }

    pub(super) fn table(
        &self,
        name: &'static str,
        schema: &Schema,
    ) -> Result<GameTable, DatasetError> {
        GameTable::open(self.container.range(name)?, name, schema)
    }
}

/// Finds the files of a game: an archive, an unpacked folder, or the `game.zip` in a folder.
pub(super) fn locate(path: &Path) -> Result<(PathBuf, Container), DatasetError> {
    if !fs::metadata(path)?.is_dir() {
        return Ok((path.to_owned(), Container::archive(path)?));
    }
    if path.join(MANIFEST_FILE).exists() {
        return Ok((path.to_owned(), Container::Folder(path.to_owned())));
    }
    let archive = path.join(GAME_FILE);
    let container = Container::archive(&archive)?;
    container.check_results_copy(&path.join(RESULTS_FILE), GAME_FILE)?;
    Ok((archive, container))
}

/// Checks that the manifest lists the expected files, and compares each with its hash.
pub(super) fn check_files(
    container: &Container,
    files: &BTreeMap<String, FileDigest>,
    expected: &[&str],
) -> Result<(), DatasetError> {
    let listed: BTreeSet<&str> = files.keys().map(String::as_str).collect();
    if listed != expected.iter().copied().collect() {
        return Err(DatasetError::Altered(format!(
            "{MANIFEST_FILE} lists {listed:?}, expected {expected:?}"
        )));
    }
    container.expect_only(expected)?;
    for (name, listed) in files {
        let found = container.digest(name)?;
        if found != *listed {
            return Err(DatasetError::Altered(format!(
                "{name} has {} bytes and BLAKE3 {}, {MANIFEST_FILE} says {} bytes and {}",
                found.bytes, found.blake3, listed.bytes, listed.blake3
            )));
        }
    }
    Ok(())
}

/// The layout that a manifest states. It is read first: a manifest of another layout may lack fields.
pub(super) fn read_schema(manifest: &[u8]) -> Result<String, DatasetError> {
    let ManifestSchema { schema } =
        serde_json::from_slice(manifest).map_err(DatasetError::unreadable(MANIFEST_FILE))?;
    Ok(schema)
}

fn read_manifest(container: &Container) -> Result<GameManifest, DatasetError> {
    let bytes = container.bytes(MANIFEST_FILE)?;
    match read_schema(&bytes)?.as_str() {
        GAME_SCHEMA => {
            serde_json::from_slice(&bytes).map_err(DatasetError::unreadable(MANIFEST_FILE))
        }
        GAME_SIDE_SCHEMA => Err(DatasetError::Foreign(format!(
            "this is one side's archive of a game, which cannot be simulated without the other side's \
             commands; verify the {GAME_FILE} of the same game"
        ))),
        other => Err(DatasetError::Foreign(format!(
            "the recording's layout is {other:?}, this version reads {GAME_SCHEMA}"
        ))),
    }
}
