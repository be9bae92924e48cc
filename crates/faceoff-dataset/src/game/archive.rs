//! Writes the archives of a game: the whole recording, and for each side (one of the two agents) the part that it may see.

use super::{
    conditions::simulator_id,
    files::{
        CLIPS_FILE, GAME_FILE, MOTION_FILE, OUTCOME_FILE, RALLIES_FILE, SIDE_OUTCOME_FILE,
        entries_file, log_file, side_file, steps_file,
    },
    recorder::{GameRecorder, Tables},
};
use crate::{
    archive_writer::ArchiveWriter,
    digest,
    error::RecordingError,
    files::{CALIBRATION_FILE, MANIFEST_FILE, RESULTS_FILE, allow_missing},
};
use faceoff_airhockey::FinishedGame;
use faceoff_scoring::tournament::{GameScore, GameSettings, score_game};
use faceoff_types::{GameOutcome, Side};
use faceoff_wire::{
    dataset::FileDigest,
    game::{
        GAME_SCHEMA, GAME_SIDE_SCHEMA, GameCalibration, GameManifest, GameSideManifest, GameSpec,
    },
};
use fs_err::{self as fs, File};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// A finished game with its recording.
#[derive(Debug)]
pub struct RecordedGame<'a> {
    /// The specification of the game.
    pub spec: &'a GameSpec,
    /// The agents' names, the first side's first.
    pub agents: &'a [String; 2],
    pub finished: FinishedGame<GameRecorder>,
    /// Timing measurements of the slot.
    pub calibration: GameCalibration,
    /// The ends of both agents' standard errors, with their faults.
    pub logs: &'a [String; 2],
}

/// Score, outcome and archives of a game.
#[derive(Debug, Clone, PartialEq)]
pub struct GameArchives {
    /// The score; identical to the recording's `results.json`.
    pub score: GameScore,
    pub outcome: GameOutcome,
    /// Size and hash of `game.zip`.
    pub game: FileDigest,
    /// Size and hash of `side-1.zip` and `side-2.zip`.
    pub sides: [FileDigest; 2],
}

/// The settings that a game's score states.
pub(super) fn game_settings(spec: &GameSpec, agents: &[String; 2]) -> GameSettings {
    GameSettings {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: spec.perturbations.clone(),
        limits: spec.limits.clone(),
        forfeit_score: spec.forfeit_score,
        seed: spec.seed,
        agents: agents.clone(),
    }
}

impl RecordedGame<'_> {
    /// Scores the game and writes `game.zip`, `side-1.zip` and `side-2.zip` to the folder `out`, each under a
    /// temporary name first. The recorder's tables, which are then in the archives, are removed.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn write(self, out: &Path) -> Result<GameArchives, RecordingError> {
        let FinishedGame {
            outcome,
            answer_times_s,
            sink,
        } = self.finished;
        let tables = sink.finish()?;
        let score = score_game(
            &game_settings(self.spec, self.agents),
            &outcome,
            &answer_times_s,
        );
        let contents = ArchiveContents {
            spec: self.spec,
            agents: self.agents,
            tables: &tables,
            calibration: &self.calibration,
            logs: self.logs,
            score: &score,
            outcome: &outcome,
        };
        let game = partial(GAME_FILE, out);
        contents.write_game(&game)?;
        let mut archives = Vec::new();
        for side in Side::BOTH {
            let name = side_file(side);
            contents.write_side(side, &partial(name, out))?;
            archives.push((name, digest::of_file(&partial(name, out))?));
        }
        let game = digest::of_file(&game)?;
        fs::rename(tables.path(CLIPS_FILE), out.join(CLIPS_FILE))?;
        fs::remove_dir_all(tables.path(""))?;
        // Rename when all archives are complete. `game.zip` is last: if it exists, the others exist too.
        for name in Side::BOTH.map(side_file).into_iter().chain([GAME_FILE]) {
            fs::rename(partial(name, out), out.join(name))?;
        }
        let [first, second] = archives.try_into().expect("one archive per side");
        let sides = [first.1, second.1];
        Ok(GameArchives {
            score,
            outcome,
            game,
            sides,
        })
    }
}

/// Path of an archive while it is incomplete.
fn partial(name: &str, out: &Path) -> PathBuf {
    out.join(name).with_extension("zip.partial")
}

/// Removes the archives of a game, complete or not, from the folder `out`.
///
/// # Errors
/// The error that kept one of them from being removed.
pub fn remove_game(out: &Path) -> std::io::Result<()> {
    let files = [GAME_FILE, CLIPS_FILE].into_iter();
    for name in files.chain(Side::BOTH.map(side_file)) {
        for path in [out.join(name), partial(name, out)] {
            allow_missing(fs::remove_file(path))?;
        }
    }
    Ok(())
}

/// The contents of the archives.
struct ArchiveContents<'a> {
    spec: &'a GameSpec,
    agents: &'a [String; 2],
    tables: &'a Tables,
    calibration: &'a GameCalibration,
    logs: &'a [String; 2],
    score: &'a GameScore,
    outcome: &'a GameOutcome,
}

impl ArchiveContents<'_> {
    fn write_game(&self, path: &Path) -> Result<(), RecordingError> {
        let mut archive = ArchiveWriter::create(path)?;
        self.add_public_tables(&mut archive)?;
        for side in Side::BOTH {
            self.add_side_files(side, &mut archive)?;
        }
        archive.add_json(OUTCOME_FILE, self.outcome)?;
        archive.add_json(RESULTS_FILE, self.score)?;
        archive.add_json(CALIBRATION_FILE, self.calibration)?;
        let manifest = GameManifest {
            schema: GAME_SCHEMA.to_owned(),
            simulator: simulator_id(),
            spec: self.spec.clone(),
            agents: self.agents.clone(),
            files: archive.files().clone(),
        };
        archive.add_json(MANIFEST_FILE, &manifest)?;
        archive.finish()
    }

    /// A side's archive: its own files and the public ones. It must not contain a seed: with the true motion, a seed
    /// would reveal the other side's observations.
    fn write_side(&self, side: Side, path: &Path) -> Result<(), RecordingError> {
        let mut archive = ArchiveWriter::create(path)?;
        self.add_public_tables(&mut archive)?;
        self.add_side_files(side, &mut archive)?;
        archive.add_json(SIDE_OUTCOME_FILE, &self.outcome.sides[side.index()])?;
        let mut results = serde_json::to_value(self.score)
            .map_err(RecordingError::unusable("writing a side's results"))?;
        if let Some(fields) = results.as_object_mut() {
            fields.remove("seed");
        }
        archive.add_json(RESULTS_FILE, &results)?;
        let manifest = GameSideManifest {
            schema: GAME_SIDE_SCHEMA.to_owned(),
            ruleset: self.spec.ruleset,
            profile: self.spec.profile,
            side,
            agents: self.agents.clone(),
            files: archive.files().clone(),
        };
        archive.add_json(MANIFEST_FILE, &manifest)?;
        archive.finish()
    }

    fn add_public_tables(&self, archive: &mut ArchiveWriter) -> Result<(), RecordingError> {
        self.add_table(MOTION_FILE, archive)?;
        self.add_table(RALLIES_FILE, archive)
    }

    fn add_side_files(
        &self,
        side: Side,
        archive: &mut ArchiveWriter,
    ) -> Result<(), RecordingError> {
        self.add_table(steps_file(side), archive)?;
        self.add_table(entries_file(side), archive)?;
        let log = &self.logs[side.index()];
        archive.add(log_file(side), |out| Ok(out.write_all(log.as_bytes())?))
    }

    fn add_table(&self, name: &str, archive: &mut ArchiveWriter) -> Result<(), RecordingError> {
        let mut table = File::open(self.tables.path(name))?;
        archive.add(name, |out| {
            std::io::copy(&mut table, out)?;
            Ok(())
        })
    }
}
