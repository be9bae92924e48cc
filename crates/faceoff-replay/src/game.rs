//! Records the clips of a game as it is played, 500 control steps each.

use crate::{
    clip::Clip,
    error::ReplayError,
    gzip::Gzip,
    header::{Break, BreakKind, CLIP_FORMAT, ClipKind, Header},
    motion::Motion,
    observed::Observed,
    pack::{Key, PackWriter},
    violations::Watch,
};
use faceoff_episode::{
    Answered, GameSink, GameStepRow, RallyEnding, RallyRow, RallyStart, RecordError,
};
use faceoff_sim::{GameState, RallyEnd, model::CONTROL_STEP_S};
use faceoff_types::{Side, WINDOW_STEPS};
use std::io::Write;

/// Control steps of a clip: a jump to any place of a game loads one of each kind.
pub const CHUNK_STEPS: u32 = WINDOW_STEPS;

/// Writes a pack of a game's clips. Memory is bounded by one clip of each kind.
pub struct GameClipRecorder<W> {
    pack: PackWriter<W>,
    chunk: Option<Chunk>,
    gzip: Gzip,
}

#[derive(Debug)]
struct Chunk {
    number: u32,
    motion: Motion,
    sides: [Observed; 2],
    watch: [Watch; 2],
    breaks: Vec<Break>,
    /// The count at the first sample, and now.
    score: [[u32; 2]; 2],
    /// The last sample so far.
    last: u32,
    state: GameState,
}

impl<W> std::fmt::Debug for GameClipRecorder<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GameClipRecorder")
            .field("chunk", &self.chunk.as_ref().map(|chunk| chunk.number))
            .finish_non_exhaustive()
    }
}

impl Chunk {
    /// Begins with the state after `number` × 500 control steps.
    fn begin(number: u32, state: &GameState, score: [u32; 2]) -> Self {
        let mut motion = Motion::of_game();
        motion.push_game(state);
        Self {
            number,
            motion,
            sides: [Observed::new(0), Observed::new(1)],
            watch: Default::default(),
            breaks: Vec::new(),
            score: [score; 2],
            last: number * CHUNK_STEPS,
            state: *state,
        }
    }

    fn step(&mut self, row: &GameStepRow<'_>) {
        let sample = row.game_step + 1;
        self.motion.push_game(row.state);
        self.motion.meet(row.game_step, row.impacts);
        for (side, of_side) in (0_u32..).zip(&row.sides) {
            let index = usize::from(side == 1);
            self.watch[index].see(side, sample, &of_side.constraints);
            let observed = &mut self.sides[index];
            match (of_side.action, of_side.answered) {
                (Some(action), Some(answered)) => {
                    observed.answer(sample, action, &answered, row.puck_lost);
                }
                // An arm that is not commanded holds where it is.
                (_, answered) => {
                    let held = row.state.q[index];
                    let answered = answered.unwrap_or(Answered {
                        computation_time_s: 0.0,
                        host_time_s: 0.0,
                        cpu_time_s: None,
                    });
                    observed.answer(sample, &held, &answered, row.puck_lost);
                }
            }
        }
        self.last = sample;
        self.state = *row.state;
    }

    fn is_full(&self) -> bool {
        self.last == (self.number + 1) * CHUNK_STEPS
    }

    /// The clips: motion, and what each side was told and commanded.
    fn end(mut self) -> (u32, [Clip; 3]) {
        let first = self.number * CHUNK_STEPS;
        let header = Header {
            format: CLIP_FORMAT.to_owned(),
            kind: ClipKind::Motion,
            contest: "game".to_owned(),
            episode: None,
            side: None,
            first,
            samples: self.last - first + 1,
            step_s: CONTROL_STEP_S,
            columns: Vec::new(),
            contacts: Vec::new(),
            violations: Vec::new(),
            breaks: Vec::new(),
            score: None,
            late: Vec::new(),
            lost: Vec::new(),
            end: None,
        };
        let [home, away] = self.sides;
        let observed = |side: u32, observed: Observed| {
            let (columns, late, lost) = observed.take();
            Clip {
                header: Header {
                    kind: ClipKind::Observed,
                    side: Some(side),
                    late,
                    lost,
                    ..header.clone()
                },
                columns,
            }
        };
        let sides = [observed(0, home), observed(1, away)];
        let (columns, contacts) = self.motion.take();
        let mut violations: Vec<_> = self.watch.iter_mut().flat_map(Watch::take).collect();
        violations.sort_by_key(|told| (told.from, told.side, told.group));
        let motion = Clip {
            header: Header {
                contacts,
                violations,
                breaks: self.breaks,
                score: Some(self.score[0]),
                ..header
            },
            columns,
        };
        let [home, away] = sides;
        (self.number, [motion, home, away])
    }
}

impl<W: Write> GameClipRecorder<W> {
    /// Begins a pack.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn new(out: W) -> Result<Self, ReplayError> {
        Ok(Self {
            pack: PackWriter::new(out)?,
            chunk: None,
            gzip: Gzip::default(),
        })
    }

    /// Adds what is left and the index.
    ///
    /// # Errors
    /// [`ReplayError::Io`].
    pub fn finish(mut self) -> Result<W, ReplayError> {
        self.end_chunk()?;
        self.pack.finish()
    }

    fn end_chunk(&mut self) -> Result<(), ReplayError> {
        let Some(chunk) = self.chunk.take() else {
            return Ok(());
        };
        let (number, [motion, home, away]) = chunk.end();
        self.pack.add(
            Key::game_motion(number),
            &motion.compressed(&mut self.gzip)?,
        )?;
        for (side, clip) in Side::BOTH.into_iter().zip([home, away]) {
            self.pack.add(
                Key::game_observed(side, number),
                &clip.compressed(&mut self.gzip)?,
            )?;
        }
        Ok(())
    }
}

impl<W: Write> GameSink for GameClipRecorder<W> {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        // Of later rallies the first sample is the one after their first step.
        self.chunk.get_or_insert_with(|| {
            Chunk::begin(start.game_step / CHUNK_STEPS, start.state, [0; 2])
        });
        Ok(())
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        if let Some(chunk) = &mut self.chunk {
            for (observed, observation) in chunk.sides.iter_mut().zip(observations) {
                observed.see(observation);
            }
        }
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        let Some(chunk) = &mut self.chunk else {
            return Ok(());
        };
        chunk.step(row);
        if chunk.is_full() {
            let (next, state, [_, score]) = (chunk.number + 1, chunk.state, chunk.score);
            self.end_chunk().map_err(not_recorded)?;
            self.chunk = Some(Chunk::begin(next, &state, score));
        }
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        if let Some(chunk) = &mut self.chunk {
            chunk.score[1] = row.score;
            chunk.breaks.push(Break {
                sample: chunk.last,
                what: what(row.ending),
                by: row.ending.by().map(|side| u32::from(side == Side::Second)),
                score: row.score,
            });
        }
        Ok(())
    }
}

fn not_recorded(error: ReplayError) -> RecordError {
    RecordError {
        what: "recording a game's clips".to_owned(),
        source: error.into(),
    }
}

const fn what(ending: RallyEnding) -> BreakKind {
    match ending {
        RallyEnding::Table(RallyEnd::Goal { .. }) => BreakKind::Goal,
        RallyEnding::Table(RallyEnd::Foul { .. }) => BreakKind::Foul,
        RallyEnding::Table(RallyEnd::Stuck) => BreakKind::Stuck,
        RallyEnding::Table(RallyEnd::LeftTable) => BreakKind::LeftTable,
        RallyEnding::Table(RallyEnd::Diverged { .. }) => BreakKind::Diverged,
        RallyEnding::GameOver => BreakKind::GameOver,
    }
}
