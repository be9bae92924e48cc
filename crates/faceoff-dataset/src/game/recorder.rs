//! Records a game while it is played: its tables, and the clips for replays (a clip is a compact recording of 500 control
//! steps).

use super::{
    files::{CLIPS_FILE, MOTION_FILE, RALLIES_FILE, entries_file, steps_file},
    rows::{GameRows, record_error},
};
use crate::{error::RecordingError, files::allow_missing, table::TableWriter};
use faceoff_airhockey::{GameSink, GameStepRow, RallyRow, RallyStart};
use faceoff_episode::RecordError;
use faceoff_replay::GameClipRecorder;
use faceoff_types::Side;
use faceoff_wire::game::GAME_SCHEMA;
use fs_err::{self as fs, File};
use std::{
    io::BufWriter,
    path::{Path, PathBuf},
};

/// Rows that are buffered in memory before they are written.
const BUFFERED_ROWS: usize = 1000;

/// Writes the tables of a game while it is played. Memory does not grow with the game's length.
pub struct GameRecorder {
    dir: PathBuf,
    rows: GameRows,
    motion: TableWriter,
    /// Observations and actions of each side.
    sides: [TableWriter; 2],
    rallies: TableWriter,
    /// Start and reset of each side before each rally.
    entries: [TableWriter; 2],
    clips: GameClipRecorder<BufWriter<File>>,
}

impl std::fmt::Debug for GameRecorder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GameRecorder")
            .field("dir", &self.dir)
            .finish_non_exhaustive()
    }
}

/// The folder with the tables of a finished game.
#[derive(Debug)]
pub(super) struct Tables {
    dir: PathBuf,
}

impl Tables {
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }
}

impl GameRecorder {
    /// Creates the tables in a folder, which is created or emptied.
    ///
    /// # Errors
    /// [`RecordingError::Io`].
    pub fn create(dir: &Path) -> Result<Self, RecordingError> {
        allow_missing(fs::remove_dir_all(dir))?;
        fs::create_dir_all(dir)?;
        let rows = GameRows::new();
        let create = |name: &str, schema| {
            TableWriter::create_with_layout(GAME_SCHEMA, &dir.join(name), schema)
        };
        let [first, second] = Side::BOTH;
        Ok(Self {
            dir: dir.to_owned(),
            motion: create(MOTION_FILE, rows.motion.schema())?,
            sides: [
                create(steps_file(first), rows.sides[0].schema())?,
                create(steps_file(second), rows.sides[1].schema())?,
            ],
            rallies: create(RALLIES_FILE, rows.rallies.schema())?,
            entries: [
                create(entries_file(first), rows.entries[0].schema())?,
                create(entries_file(second), rows.entries[1].schema())?,
            ],
            clips: GameClipRecorder::new(BufWriter::new(File::create(dir.join(CLIPS_FILE))?))?,
            rows,
        })
    }

    fn write_steps(&mut self) -> Result<(), RecordingError> {
        self.motion.write(self.rows.motion.take())?;
        for (table, rows) in self.sides.iter_mut().zip(&mut self.rows.sides) {
            table.write(rows.take())?;
        }
        Ok(())
    }

    /// Writes the buffered rows and closes the tables.
    pub(super) fn finish(mut self) -> Result<Tables, RecordingError> {
        self.write_steps()?;
        self.rallies.write(self.rows.rallies.take())?;
        for (table, rows) in self.entries.iter_mut().zip(&mut self.rows.entries) {
            table.write(rows.take())?;
        }
        self.motion.finish()?;
        self.rallies.finish()?;
        for table in self.sides.into_iter().chain(self.entries) {
            table.finish()?;
        }
        let clips = self.clips.finish()?;
        let clips = clips
            .into_inner()
            .map_err(std::io::IntoInnerError::into_error)?;
        clips.sync_all()?;
        Ok(Tables { dir: self.dir })
    }
}

impl GameSink for GameRecorder {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.clips.begin_rally(start)?;
        self.rows.begin_rally(start)
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        self.clips.observe(observations);
        self.rows.observe(observations);
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        self.clips.step(row)?;
        self.rows.step(row)?;
        if self.rows.motion.len() >= BUFFERED_ROWS {
            self.write_steps().map_err(record_error)?;
        }
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        self.clips.end_rally(row)?;
        self.rows.end_rally(row)
    }
}
