//! Simulates a recorded game again: the recording gives the inputs (answers, times, faults), and every simulated row is
//! compared with the recorded one. This is not the replay that browsers show.

use super::{
    conditions::game_simulation_setup,
    files::{MOTION_FILE, RALLIES_FILE, entries_file, steps_file},
    recorded_inputs::{RecordedEntry, RecordedResponse, RowLocation},
    recording::GameRecording,
    rows::GameRows,
    table::GameTable,
};
use crate::{
    dataset::Columns,
    error::DatasetError,
    verify::{Difference, VerifyError, compare},
};
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::SchemaRef;
use faceoff_airhockey::{FinishedGame, RunningGame};
use faceoff_episode::RecordError;
use faceoff_sim::Interpolation;
use faceoff_types::{AgentFault, Side};

/// Simulates a game again with its recorded inputs.
pub(super) struct GameReplay {
    game: RunningGame<GameRows>,
    rallies: GameTable,
    entries: [GameTable; 2],
    motion: GameTable,
    steps: [GameTable; 2],
}

/// Recorded data of both sides for the current rally.
struct RecordedRally {
    /// For each side the row of its start and reset.
    entries: [RecordBatch; 2],
    interpolations: [Interpolation; 2],
    faults: [Option<AgentFault>; 2],
}

impl GameReplay {
    pub fn open(recording: &GameRecording) -> Result<Self, DatasetError> {
        let spec = &recording.manifest().spec;
        let setup = game_simulation_setup(spec)
            .map_err(|unknown| DatasetError::Foreign(unknown.to_string()))?;
        let simulated_rows = GameRows::new();
        let entries = |side: Side| {
            let schema = simulated_rows.entries[side.index()].schema();
            recording.table(entries_file(side), schema)
        };
        let steps = |side: Side| {
            let schema = simulated_rows.sides[side.index()].schema();
            recording.table(steps_file(side), schema)
        };
        Ok(Self {
            rallies: recording.table(RALLIES_FILE, simulated_rows.rallies.schema())?,
            entries: [entries(Side::First)?, entries(Side::Second)?],
            motion: recording.table(MOTION_FILE, simulated_rows.motion.schema())?,
            steps: [steps(Side::First)?, steps(Side::Second)?],
            game: RunningGame::begin(&setup, spec.steps, spec.limits.clone(), simulated_rows),
        })
    }

    /// Simulates the whole game; `progress` receives the number of control steps of each batch.
    pub fn play(mut self, progress: &dyn Fn(u64)) -> Result<FinishedGame<GameRows>, VerifyError> {
        while let Some(rally) = self.rallies.next_row()? {
            self.replay_rally(&rally, progress)?;
        }
        let number = self.game.rally();
        let location_in = |file| RowLocation {
            file,
            rally: number,
            step: None,
        };
        if self.game.end().is_none() {
            let expected = "another rally: the game has not ended";
            return Err(location_in(RALLIES_FILE)
                .difference("rows", "no more", expected)
                .into());
        }
        for table in &mut self.entries {
            if table.fill()? > 0 {
                let location = location_in(table.name());
                return Err(location
                    .difference("rows", "another row", "no more rallies")
                    .into());
            }
        }
        let [first, second] = &mut self.steps;
        for table in [&mut self.motion, first, second] {
            if table.fill()? > 0 {
                let location = location_in(table.name());
                return Err(location
                    .difference("rows", "another row", "no more steps")
                    .into());
            }
        }
        Ok(self.game.finish())
    }

    /// Simulates one rally; `row` is its row in the table of rallies.
    fn replay_rally(
        &mut self,
        row: &RecordBatch,
        progress: &dyn Fn(u64),
    ) -> Result<(), VerifyError> {
        let number = self.game.rally();
        let location = RowLocation {
            file: RALLIES_FILE,
            rally: number,
            step: None,
        };
        if self.game.end().is_some() {
            let expected = "no more: the game has ended";
            return Err(location
                .difference("rows", "another rally", expected)
                .into());
        }
        let recorded = self.start_rally(number)?;
        let count = Columns(row).int("steps", 0).unwrap_or_default();
        let mut remaining = count as usize;
        while remaining > 0 {
            let simulated_steps = self.replay_steps(remaining, number, &recorded)?;
            progress(simulated_steps as u64);
            remaining -= simulated_steps;
        }
        if self.game.is_in_rally() {
            let expected = "more: the rally has not ended";
            return Err(location
                .difference("steps", count.to_string(), expected)
                .into());
        }
        let simulated_rows = self.game.sink();
        let rallies = &mut simulated_rows.rallies;
        let simulated = batch(rallies.take(), rallies.schema());
        check_same(location, row, &simulated)?;
        for side in Side::BOTH {
            let entries = &mut simulated_rows.entries[side.index()];
            let simulated = batch(entries.take(), entries.schema());
            let file = entries_file(side);
            check_same(
                RowLocation { file, ..location },
                &recorded.entries[side.index()],
                &simulated,
            )?;
        }
        Ok(())
    }

    /// Starts a rally with the recorded start and reset of both sides.
    fn start_rally(&mut self, rally: u32) -> Result<RecordedRally, VerifyError> {
        let mut read = |side: Side| -> Result<(RecordBatch, RecordedEntry), VerifyError> {
            let location = RowLocation {
                file: entries_file(side),
                rally,
                step: None,
            };
            let row = self.entries[side.index()].next_row()?;
            let row =
                row.ok_or_else(|| location.difference("rows", "no more", "a row of this rally"))?;
            let entry = RecordedEntry::read(&row, side, self.game.needs_start(side), location)?;
            Ok((row, entry))
        };
        let [(first_row, first), (second_row, second)] = [read(Side::First)?, read(Side::Second)?];
        // The interpolation of a side that failed to start is not used.
        let interpolation = |entry: &RecordedEntry| {
            entry
                .readiness
                .interpolation()
                .unwrap_or(Interpolation::Cubic)
        };
        let recorded = RecordedRally {
            entries: [first_row, second_row],
            interpolations: [interpolation(&first), interpolation(&second)],
            faults: [first.step_fault, second.step_fault],
        };
        self.game
            .start_rally([first.readiness, second.readiness])
            .map_err(unbuildable_row)?;
        Ok(recorded)
    }

    /// Simulates up to `max_steps` steps of a rally and compares the resulting rows.
    fn replay_steps(
        &mut self,
        max_steps: usize,
        rally: u32,
        recorded: &RecordedRally,
    ) -> Result<usize, VerifyError> {
        let first_step = self.game.rally_steps();
        let mut count = max_steps;
        let [first, second] = &mut self.steps;
        for table in [&mut self.motion, first, second] {
            count = count.min(table.fill()?);
            if count == 0 {
                let location = RowLocation {
                    file: table.name(),
                    rally,
                    step: Some(first_step),
                };
                return Err(location
                    .difference("rows", "no more", "a row of this step")
                    .into());
            }
        }
        let motion = take_rows(&mut self.motion, count);
        let sides = [0, 1].map(|side| take_rows(&mut self.steps[side], count));
        let error = (0..count).find_map(|row| self.step(&sides, row, rally, recorded).err());
        // A difference before the error is reported first.
        let simulated_rows = self.game.sink();
        let simulated_motion = &mut simulated_rows.motion;
        let simulated = batch(simulated_motion.take(), simulated_motion.schema());
        let mut compared = vec![(MOTION_FILE, &motion, simulated)];
        for side in Side::BOTH {
            let simulated_side = &mut simulated_rows.sides[side.index()];
            let simulated = batch(simulated_side.take(), simulated_side.schema());
            compared.push((steps_file(side), &sides[side.index()], simulated));
        }
        let earliest = compared
            .iter()
            .filter_map(|(file, recorded_rows, simulated)| {
                Some((
                    file,
                    compare::first_row_difference(recorded_rows, simulated)?,
                ))
            })
            .min_by_key(|(_, cell)| cell.row);
        if let Some((file, cell)) = earliest {
            let location = RowLocation {
                file,
                rally,
                step: Some(first_step.saturating_add(u32::try_from(cell.row).unwrap_or(u32::MAX))),
            };
            let difference = location.difference(&cell.field, cell.recorded, cell.expected);
            return Err(difference.into());
        }
        error.map_or(Ok(count), Err)
    }

    /// Simulates one step with the answers in row `row` of both sides' tables.
    fn step(
        &mut self,
        sides: &[RecordBatch; 2],
        row: usize,
        rally: u32,
        recorded: &RecordedRally,
    ) -> Result<(), VerifyError> {
        let step = Some(self.game.rally_steps());
        if !self.game.is_in_rally() {
            let location = RowLocation {
                file: RALLIES_FILE,
                rally,
                step,
            };
            let expected = "no more steps: the rally has ended";
            return Err(location
                .difference("steps", "another step", expected)
                .into());
        }
        let read = |side: Side| {
            let location = RowLocation {
                file: steps_file(side),
                rally,
                step,
            };
            let index = side.index();
            RecordedResponse::read(
                &sides[index],
                row,
                recorded.interpolations[index],
                self.game.fault(side).is_none(),
                recorded.faults[index].as_ref(),
                location,
            )
        };
        let [first, second] = [read(Side::First)?, read(Side::Second)?];
        self.game
            .answer([first.response(), second.response()])
            .map_err(unbuildable_row)
    }
}

fn take_rows(table: &mut GameTable, count: usize) -> RecordBatch {
    table
        .take(count)
        .expect("`count` is at most the number of buffered rows")
}

fn batch(columns: Vec<ArrayRef>, schema: &SchemaRef) -> RecordBatch {
    RecordBatch::try_new(schema.clone(), columns).expect("the rows are built by their own schema")
}

/// Refuses a simulated row that differs from the recorded one.
fn check_same(
    location: RowLocation,
    recorded: &RecordBatch,
    simulated: &RecordBatch,
) -> Result<(), Difference> {
    match compare::first_row_difference(recorded, simulated) {
        None => Ok(()),
        Some(cell) => Err(location.difference(&cell.field, cell.recorded, cell.expected)),
    }
}

/// An error of [`GameRows`], which cannot build a row from the recorded values.
fn unbuildable_row(error: RecordError) -> VerifyError {
    DatasetError::Unreadable(error.to_string()).into()
}
