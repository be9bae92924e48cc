//! The table of a game's rallies.

use super::{files::RALLIES_FILE, recording::GameRecording, rows::GameRows, table::GameTable};
use crate::error::DatasetError;
use arrow_array::{
    Array as _, RecordBatch, StringArray, UInt32Array,
    cast::AsArray as _,
    types::{Float64Type, UInt32Type},
};
use faceoff_types::MAX_GAME_STEPS;
use serde::Serialize;

/// A rally of a recorded game.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ListedRally {
    /// Number of the rally, from 0.
    pub rally: u32,
    /// First control step of the rally, counted from the start of the game.
    pub game_step: u32,
    /// Side that served, 1 or 2.
    pub serves: u32,
    /// Control steps of the rally.
    pub steps: u32,
    /// Why it ended, such as `goal`, `foul` or `stuck`.
    pub end: String,
    /// Side that scored the goal or committed the foul, 1 or 2; `None` if the rally ended otherwise.
    pub by: Option<u32>,
    /// Score after the rally.
    pub score: [u32; 2],
    /// x, y of the puck before the first step, m, table frame.
    #[serde(skip)]
    pub initial_puck: [f64; 2],
}

impl GameRecording {
    /// The rallies of the game, as they were recorded.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if the table is damaged, or has more rallies than a game has control steps.
    pub fn rallies(&self) -> Result<Vec<ListedRally>, DatasetError> {
        read_rallies(self.table(RALLIES_FILE, GameRows::new().rallies.schema())?)
    }
}

/// Reads the rallies of an open table.
pub(super) fn read_rallies(mut table: GameTable) -> Result<Vec<ListedRally>, DatasetError> {
    let mut rallies = Vec::new();
    while let Some(row) = table.next_row()? {
        if rallies.len() > MAX_GAME_STEPS as usize {
            return Err(DatasetError::Unreadable(format!(
                "{RALLIES_FILE} has more rallies than a game has control steps"
            )));
        }
        rallies.push(ListedRally::from_row(&row));
    }
    Ok(rallies)
}

impl ListedRally {
    /// Control steps of the game at the end of the rally.
    #[must_use]
    pub const fn end_step(&self) -> u32 {
        self.game_step.saturating_add(self.steps)
    }

    /// Of a row with the columns of the table's schema.
    fn from_row(row: &RecordBatch) -> Self {
        let column = |name: &str| -> &UInt32Array { row[name].as_primitive::<UInt32Type>() };
        let ends: &StringArray = row["end"].as_string();
        let by = column("by");
        Self {
            rally: column("rally").value(0),
            game_step: column("game_step").value(0),
            serves: column("serves").value(0),
            steps: column("steps").value(0),
            end: ends.value(0).to_owned(),
            by: by.is_valid(0).then(|| by.value(0)),
            score: ["score_1", "score_2"].map(|name| column(name).value(0)),
            initial_puck: ["initial_puck_x", "initial_puck_y"]
                .map(|name| row[name].as_primitive::<Float64Type>().value(0)),
        }
    }
}
