//! Collects the rows of all tables of a game in memory.

use crate::{
    error::RecordingError,
    table::{EntryRows, MotionRows, RallyRows, SideRows},
};
use faceoff_airhockey::{GameSink, GameStepRow, RallyRow, RallyStart};
use faceoff_episode::RecordError;
use faceoff_types::Side;

/// The rows of all tables of a game.
pub(super) struct GameRows {
    pub motion: MotionRows,
    /// Observations and actions of each side.
    pub sides: [SideRows; 2],
    pub rallies: RallyRows,
    /// Start and reset of each side before each rally.
    pub entries: [EntryRows; 2],
}

impl GameRows {
    pub fn new() -> Self {
        Self {
            motion: MotionRows::new(),
            sides: Side::BOTH.map(SideRows::new),
            rallies: RallyRows::new(),
            entries: Side::BOTH.map(EntryRows::new),
        }
    }
}

/// Converts the error of a row that could not be recorded.
pub(super) fn record_error(error: RecordingError) -> RecordError {
    RecordError {
        what: "recording a game".to_owned(),
        source: error.into(),
    }
}

impl GameSink for GameRows {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.rallies.begin(start);
        self.entries.iter_mut().for_each(|rows| rows.begin(start));
        Ok(())
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        for (rows, observation) in self.sides.iter_mut().zip(observations) {
            rows.observe(observation);
        }
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        self.motion.push(row);
        self.sides.iter_mut().for_each(|rows| rows.push(row));
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        self.rallies.end(row);
        for (rows, fault) in self.entries.iter_mut().zip(row.faults) {
            rows.end(fault).map_err(record_error)?;
        }
        Ok(())
    }
}
