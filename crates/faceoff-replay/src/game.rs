//! Records the clips of a game for replays while it is played: for each *chunk* of 500 control steps one clip of the motion and
//! one of each side's observations and commands.

use crate::{
    agent_view::AgentView,
    clip::Clip,
    error::ReplayError,
    gzip::Gzip,
    header::{ClipKind, Header, RallyEndEvent, RallyEndKind},
    motion::Motion,
    pack::{ClipKey, PackWriter},
    violations::ViolationTracker,
};
use faceoff_airhockey::{GameSink, GameStepRow, RallyEnding, RallyRow, RallyStart};
use faceoff_episode::{AnswerTiming, RecordError};
use faceoff_sim::{GameState, RallyEnd};
use faceoff_types::{Side, WINDOW_STEPS};
use std::io::Write;

/// Control steps per clip. A jump within a game loads one clip of each kind.
pub const CHUNK_STEPS: u32 = WINDOW_STEPS;

/// Writes a pack of a game's clips. It holds one clip of each kind in memory.
pub struct GameClipRecorder<W> {
    pack: PackWriter<W>,
    chunk: Option<Chunk>,
    gzip: Gzip,
}

/// The chunk that is being recorded. Its number and samples (states after control steps) are counted from the game's start.
#[derive(Debug)]
struct Chunk {
    number: u32,
    motion: Motion,
    views: [AgentView; 2],
    trackers: [ViolationTracker; 2],
    rally_ends: Vec<RallyEndEvent>,
    /// The score at the first sample.
    initial_score: [u32; 2],
    /// The current score.
    score: [u32; 2],
    /// The last sample so far, and its state.
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
    /// Starts with the state after `number` × 500 control steps.
    fn begin(number: u32, state: &GameState, score: [u32; 2]) -> Self {
        let mut motion = Motion::for_game();
        motion.push_game(state);
        Self {
            number,
            motion,
            views: [AgentView::new(0), AgentView::new(1)],
            trackers: Default::default(),
            rally_ends: Vec::new(),
            initial_score: score,
            score,
            last: number * CHUNK_STEPS,
            state: *state,
        }
    }

    fn step(&mut self, row: &GameStepRow<'_>) {
        let sample = row.game_step + 1;
        self.motion.push_game(row.state);
        self.motion.add_contacts(row.game_step, row.impacts);
        for (side, side_step) in (0_u32..).zip(&row.sides) {
            let index = usize::from(side == 1);
            self.trackers[index].update(side, sample, &side_step.constraints);
            let view = &mut self.views[index];
            match (side_step.action, side_step.timing) {
                (Some(action), Some(timing)) => {
                    view.answer(sample, action, &timing, row.puck_lost);
                }
                // Without a command the arm holds its position.
                (_, timing) => {
                    let joint_positions = row.state.q[index];
                    let timing = timing.unwrap_or(AnswerTiming {
                        computation_time_s: 0.0,
                        host_time_s: 0.0,
                        cpu_time_s: None,
                    });
                    view.answer(sample, &joint_positions, &timing, row.puck_lost);
                }
            }
        }
        self.last = sample;
        self.state = *row.state;
    }

    fn is_full(&self) -> bool {
        self.last == (self.number + 1) * CHUNK_STEPS
    }

    /// The chunk's number and its clips: the motion, and the view of each side.
    fn end(mut self) -> (u32, [Clip; 3]) {
        let first = self.number * CHUNK_STEPS;
        let header = Header::new("game", first, self.last - first + 1);
        let [home, away] = self.views;
        let view_clip = |side: u32, view: AgentView| {
            let (columns, late, tracking_gaps) = view.take();
            Clip {
                header: Header {
                    kind: ClipKind::Observed,
                    side: Some(side),
                    late,
                    tracking_gaps,
                    ..header.clone()
                },
                columns,
            }
        };
        let view_clips = [view_clip(0, home), view_clip(1, away)];
        let (columns, contacts) = self.motion.take();
        let mut violations: Vec<_> = self
            .trackers
            .iter_mut()
            .flat_map(ViolationTracker::take)
            .collect();
        violations.sort_by_key(|span| (span.from, span.side, span.constraint));
        let motion = Clip {
            header: Header {
                contacts,
                violations,
                rally_ends: self.rally_ends,
                score: Some(self.initial_score),
                ..header
            },
            columns,
        };
        let [home, away] = view_clips;
        (self.number, [motion, home, away])
    }
}

impl<W: Write> GameClipRecorder<W> {
    /// Starts a pack.
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

    /// Writes the last clips and the index.
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
            ClipKey::game_motion(number),
            &motion.compressed(&mut self.gzip)?,
        )?;
        for (side, clip) in Side::BOTH.into_iter().zip([home, away]) {
            self.pack.add(
                ClipKey::game_observed(side, number),
                &clip.compressed(&mut self.gzip)?,
            )?;
        }
        Ok(())
    }
}

impl<W: Write> GameSink for GameClipRecorder<W> {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        // Only the first rally begins a chunk with its initial state. In later rallies the initial state is not a sample:
        // their first sample is the state after the first step.
        self.chunk.get_or_insert_with(|| {
            Chunk::begin(start.game_step / CHUNK_STEPS, start.state, [0; 2])
        });
        Ok(())
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        if let Some(chunk) = &mut self.chunk {
            for (view, observation) in chunk.views.iter_mut().zip(observations) {
                view.observe(observation);
            }
        }
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        let Some(chunk) = &mut self.chunk else {
            return Ok(());
        };
        chunk.step(row);
        if chunk.is_full() {
            let (next, state, score) = (chunk.number + 1, chunk.state, chunk.score);
            self.end_chunk().map_err(record_error)?;
            self.chunk = Some(Chunk::begin(next, &state, score));
        }
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        if let Some(chunk) = &mut self.chunk {
            chunk.score = row.score;
            chunk.rally_ends.push(RallyEndEvent {
                sample: chunk.last,
                kind: rally_end_kind(row.ending),
                by: row
                    .ending
                    .responsible_side()
                    .map(|side| u32::from(side == Side::Second)),
                score: row.score,
            });
        }
        Ok(())
    }
}

fn record_error(error: ReplayError) -> RecordError {
    RecordError {
        what: "recording a game's clips".to_owned(),
        source: error.into(),
    }
}

const fn rally_end_kind(ending: RallyEnding) -> RallyEndKind {
    match ending {
        RallyEnding::Table(RallyEnd::Goal { .. }) => RallyEndKind::Goal,
        RallyEnding::Table(RallyEnd::Foul { .. }) => RallyEndKind::Foul,
        RallyEnding::Table(RallyEnd::Stuck) => RallyEndKind::Stuck,
        RallyEnding::Table(RallyEnd::LeftTable) => RallyEndKind::LeftTable,
        RallyEnding::Table(RallyEnd::Diverged { .. }) => RallyEndKind::Diverged,
        RallyEnding::GameOver => RallyEndKind::GameOver,
    }
}
