//! The archives of a game: the whole recording, and what each side may have of it.

use super::{
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
    files::{CALIBRATION_FILE, MANIFEST_FILE, RESULTS_FILE},
    simulator::simulator_id,
};
use faceoff_episode::FinishedGame;
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
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

/// A game that is over, as it is recorded.
#[derive(Debug)]
pub struct RecordedGame<'a> {
    /// What was to be played.
    pub spec: &'a GameSpec,
    /// The agents' names, the first side's first.
    pub agents: &'a [String; 2],
    pub played: FinishedGame<GameRecorder>,
    /// How evenly the slot kept time.
    pub calibration: GameCalibration,
    /// The ends of both agents' standard errors, with their faults.
    pub logs: &'a [String; 2],
}

/// What is left of a game.
#[derive(Debug, Clone, PartialEq)]
pub struct GameArchives {
    /// The score, which is also the recording's `results.json`.
    pub score: GameScore,
    pub outcome: GameOutcome,
    /// Size and hash of `game.zip`.
    pub game: FileDigest,
    /// Of `side-1.zip` and `side-2.zip`.
    pub sides: [FileDigest; 2],
}

/// By what a game's score is told.
pub(super) fn played_as(spec: &GameSpec, agents: &[String; 2]) -> GameSettings {
    GameSettings {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: spec.perturbations.clone(),
        limits: spec.limits.clone(),
        seed: spec.seed,
        agents: agents.clone(),
    }
}

impl RecordedGame<'_> {
    /// Scores the game and writes `game.zip`, `side-1.zip` and `side-2.zip` to the folder `out`, each under a
    /// temporary name first. The tables are removed.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn write(self, out: &Path) -> Result<GameArchives, RecordingError> {
        let FinishedGame {
            outcome,
            answer_times_s,
            sink,
        } = self.played;
        let tables = sink.finish()?;
        let score = score_game(
            &played_as(self.spec, self.agents),
            &outcome,
            &answer_times_s,
        );
        let files = Files {
            spec: self.spec,
            agents: self.agents,
            tables: &tables,
            calibration: &self.calibration,
            logs: self.logs,
            score: &score,
            outcome: &outcome,
        };
        let game = partial(GAME_FILE, out);
        files.write_game(&game)?;
        let mut archives = Vec::new();
        for side in Side::BOTH {
            let name = side_file(side);
            files.write_side(side, &partial(name, out))?;
            archives.push((name, digest::of_file(&partial(name, out))?));
        }
        let game = digest::of_file(&game)?;
        fs::rename(tables.path(CLIPS_FILE), out.join(CLIPS_FILE))?;
        fs::remove_dir_all(tables.path(""))?;
        // All are there, so all get their names; the game last, for who finds it finds all of them.
        for name in Side::BOTH.map(side_file).into_iter().chain([GAME_FILE]) {
            fs::rename(partial(name, out), out.join(name))?;
        }
        let [first, second] = archives.try_into().expect("one of each side");
        let sides = [first.1, second.1];
        Ok(GameArchives {
            score,
            outcome,
            game,
            sides,
        })
    }
}

/// Where an archive is written before it is complete.
fn partial(name: &str, out: &Path) -> PathBuf {
    out.join(name).with_extension("zip.partial")
}

/// Removes the archives of a game, and what of them is half written, from the folder `out`.
///
/// # Errors
/// Why one of them is still there.
pub fn clear_game(out: &Path) -> std::io::Result<()> {
    let files = [GAME_FILE, CLIPS_FILE].into_iter();
    for name in files.chain(Side::BOTH.map(side_file)) {
        for path in [out.join(name), partial(name, out)] {
            match fs::remove_file(path) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
    }
    Ok(())
}

/// What the archives are made of.
struct Files<'a> {
    spec: &'a GameSpec,
    agents: &'a [String; 2],
    tables: &'a Tables,
    calibration: &'a GameCalibration,
    logs: &'a [String; 2],
    score: &'a GameScore,
    outcome: &'a GameOutcome,
}

impl Files<'_> {
    fn write_game(&self, path: &Path) -> Result<(), RecordingError> {
        let mut archive = ArchiveWriter::create(path)?;
        self.add_public_tables(&mut archive)?;
        for side in Side::BOTH {
            self.add_own(side, &mut archive)?;
        }
        archive.add_json(OUTCOME_FILE, self.outcome)?;
        archive.add_json(RESULTS_FILE, self.score)?;
        archive.add_json(CALIBRATION_FILE, self.calibration)?;
        let manifest = GameManifest {
            schema: GAME_SCHEMA.to_owned(),
            simulator: simulator_id().clone(),
            spec: self.spec.clone(),
            agents: self.agents.clone(),
            files: archive.files().clone(),
        };
        archive.add_json(MANIFEST_FILE, &manifest)?;
        archive.finish()
    }

    /// What a side may have: its own, and what anybody may see. Nothing in it names a seed, by which the
    /// other side's observations could be made again from the true motion.
    fn write_side(&self, side: Side, path: &Path) -> Result<(), RecordingError> {
        let mut archive = ArchiveWriter::create(path)?;
        self.add_public_tables(&mut archive)?;
        self.add_own(side, &mut archive)?;
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

    fn add_own(&self, side: Side, archive: &mut ArchiveWriter) -> Result<(), RecordingError> {
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
