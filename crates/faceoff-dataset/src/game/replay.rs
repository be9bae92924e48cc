use super::{
    files::{MOTION_FILE, RALLIES_FILE, entries_file, steps_file},
    given::{GivenEntry, GivenResponse, Place},
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
use faceoff_episode::{Arena, FinishedGame, RunningGame, RecordError};
use faceoff_types::{AgentFault, Interpolation, Side};

/// A game being simulated again with what was recorded of it.
pub(super) struct Replay {
    course: RunningGame<GameRows>,
    rallies: GameTable,
    entries: [GameTable; 2],
    motion: GameTable,
    steps: [GameTable; 2],
}

/// What is recorded of both sides for the rally under way.
struct Given {
    /// How both sides got ready.
    entries: [RecordBatch; 2],
    interpolations: [Interpolation; 2],
    faults: [Option<AgentFault>; 2],
}

impl Replay {
    pub fn open(recording: &GameRecording) -> Result<Self, DatasetError> {
        let spec = &recording.manifest().spec;
        let arena = Arena::with_ruleset(
            spec.ruleset,
            spec.profile,
            &spec.perturbations,
            spec.seed,
            spec.mismatch_seed,
        );
        let rows = GameRows::new();
        let entries =
            |side: Side| recording.table(entries_file(side), rows.entries[side.index()].schema());
        let steps =
            |side: Side| recording.table(steps_file(side), rows.sides[side.index()].schema());
        Ok(Self {
            rallies: recording.table(RALLIES_FILE, rows.rallies.schema())?,
            entries: [entries(Side::First)?, entries(Side::Second)?],
            motion: recording.table(MOTION_FILE, rows.motion.schema())?,
            steps: [steps(Side::First)?, steps(Side::Second)?],
            course: RunningGame::begin(&arena, spec.steps, spec.limits.clone(), rows),
        })
    }

    /// Plays all of it; `progress` is told how many control steps have been.
    pub fn play(mut self, progress: &dyn Fn(u64)) -> Result<FinishedGame<GameRows>, VerifyError> {
        while let Some(rally) = self.rallies.next_row()? {
            self.rally(&rally, progress)?;
        }
        let number = self.course.rally();
        let at = |file| Place {
            file,
            rally: number,
            step: None,
        };
        if self.course.end().is_none() {
            let expected = "another rally: the game has not ended";
            return Err(at(RALLIES_FILE).differs("rows", "no more", expected).into());
        }
        for table in &mut self.entries {
            if table.fill()? > 0 {
                let at = at(table.name());
                return Err(at.differs("rows", "another row", "no more rallies").into());
            }
        }
        let [first, second] = &mut self.steps;
        for table in [&mut self.motion, first, second] {
            if table.fill()? > 0 {
                let at = at(table.name());
                return Err(at.differs("rows", "another row", "no more steps").into());
            }
        }
        Ok(self.course.finish())
    }

    fn rally(&mut self, row: &RecordBatch, progress: &dyn Fn(u64)) -> Result<(), VerifyError> {
        let number = self.course.rally();
        let at = Place {
            file: RALLIES_FILE,
            rally: number,
            step: None,
        };
        if self.course.end().is_some() {
            let expected = "no more: the game has ended";
            return Err(at.differs("rows", "another rally", expected).into());
        }
        let given = self.start(number)?;
        let count = Columns(row).int("steps", 0).unwrap_or_default();
        let mut left = count as usize;
        while left > 0 {
            let played = self.piece(left, number, &given)?;
            progress(played as u64);
            left -= played;
        }
        if self.course.is_in_rally() {
            let expected = "more: the rally has not ended";
            return Err(at.differs("steps", count.to_string(), expected).into());
        }
        let rows = self.course.sink();
        let played = batch(rows.rallies.take(), rows.rallies.schema());
        differs(at, row, &played)?;
        for side in Side::BOTH {
            let rows = &mut rows.entries[side.index()];
            let played = batch(rows.take(), rows.schema());
            let file = entries_file(side);
            differs(Place { file, ..at }, &given.entries[side.index()], &played)?;
        }
        Ok(())
    }

    /// Gets both sides ready.
    fn start(&mut self, rally: u32) -> Result<Given, VerifyError> {
        let mut read = |side: Side| -> Result<(RecordBatch, GivenEntry), VerifyError> {
            let at = Place {
                file: entries_file(side),
                rally,
                step: None,
            };
            let row = self.entries[side.index()].next_row()?;
            let row = row.ok_or_else(|| at.differs("rows", "no more", "a row of this rally"))?;
            let entry = GivenEntry::read(&row, side, self.course.needs_start(side), at)?;
            Ok((row, entry))
        };
        let [(first_row, first), (second_row, second)] = [read(Side::First)?, read(Side::Second)?];
        // Of one that does not play nothing is interpolated.
        let interpolation =
            |given: &GivenEntry| given.entry.interpolation().unwrap_or(Interpolation::Cubic);
        let given = Given {
            entries: [first_row, second_row],
            interpolations: [interpolation(&first), interpolation(&second)],
            faults: [first.later, second.later],
        };
        self.course
            .start_rally([first.entry, second.entry])
            .map_err(not_built)?;
        Ok(given)
    }

    /// Plays some steps of a rally, `most` at most, and compares what they led to.
    fn piece(&mut self, most: usize, rally: u32, given: &Given) -> Result<usize, VerifyError> {
        let first_step = self.course.rally_steps();
        let mut count = most;
        let [first, second] = &mut self.steps;
        for table in [&mut self.motion, first, second] {
            count = count.min(table.fill()?);
            if count == 0 {
                let at = Place {
                    file: table.name(),
                    rally,
                    step: Some(first_step),
                };
                return Err(at.differs("rows", "no more", "a row of this step").into());
            }
        }
        let motion = taken(&mut self.motion, count);
        let sides = [0, 1].map(|side| taken(&mut self.steps[side], count));
        let trouble = (0..count).find_map(|row| self.step(&sides, row, rally, given).err());
        // What was played before the trouble comes first.
        let rows = self.course.sink();
        let played = batch(rows.motion.take(), rows.motion.schema());
        let mut compared = vec![(MOTION_FILE, &motion, played)];
        for side in Side::BOTH {
            let rows = &mut rows.sides[side.index()];
            let played = batch(rows.take(), rows.schema());
            compared.push((steps_file(side), &sides[side.index()], played));
        }
        let earliest = compared
            .iter()
            .filter_map(|(file, recorded, played)| Some((file, compare::rows(recorded, played)?)))
            .min_by_key(|(_, cell)| cell.row);
        if let Some((file, cell)) = earliest {
            let at = Place {
                file,
                rally,
                step: Some(first_step.saturating_add(u32::try_from(cell.row).unwrap_or(u32::MAX))),
            };
            let difference = at.differs(&cell.field, cell.recorded, cell.expected);
            return Err(difference.into());
        }
        trouble.map_or(Ok(count), Err)
    }

    fn step(
        &mut self,
        sides: &[RecordBatch; 2],
        row: usize,
        rally: u32,
        given: &Given,
    ) -> Result<(), VerifyError> {
        let step = Some(self.course.rally_steps());
        if !self.course.is_in_rally() {
            let at = Place {
                file: RALLIES_FILE,
                rally,
                step,
            };
            let expected = "no more steps: the rally has ended";
            return Err(at.differs("steps", "another step", expected).into());
        }
        let read = |side: Side| {
            let at = Place {
                file: steps_file(side),
                rally,
                step,
            };
            let index = side.index();
            GivenResponse::read(
                &sides[index],
                row,
                given.interpolations[index],
                self.course.fault(side).is_none(),
                given.faults[index].as_ref(),
                at,
            )
        };
        let [first, second] = [read(Side::First)?, read(Side::Second)?];
        self.course
            .answer([first.response(), second.response()])
            .map_err(not_built)
    }
}

fn taken(table: &mut GameTable, count: usize) -> RecordBatch {
    table
        .take(count)
        .expect("so many rows were seen to be there")
}

fn batch(columns: Vec<ArrayRef>, schema: &SchemaRef) -> RecordBatch {
    RecordBatch::try_new(schema.clone(), columns).expect("the rows are built by their own schema")
}

fn differs(at: Place, recorded: &RecordBatch, played: &RecordBatch) -> Result<(), Difference> {
    match compare::rows(recorded, played) {
        None => Ok(()),
        Some(cell) => Err(at.differs(&cell.field, cell.recorded, cell.expected)),
    }
}

fn not_built(error: RecordError) -> VerifyError {
    DatasetError::Unreadable(error.to_string()).into()
}
