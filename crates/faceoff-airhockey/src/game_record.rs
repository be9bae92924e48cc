//! Inputs of a game between two agents, the *sides*, and the rows of its recording. A game is a sequence of rallies; a *rally* lasts
//! from a serve to a goal, a foul or another end. In pairs, the first side comes first.

use faceoff_episode::{AnswerTiming, NullSink, RecordError};
use faceoff_sim::{ConstraintValues, GameState, Impact, Interpolation, RallyEnd};
use faceoff_types::{AgentFault, AgentFaultKind, Side};

/// A fault of a side's agent, without its position in the game.
#[derive(Debug, Clone, PartialEq)]
pub struct SideFault {
    pub kind: AgentFaultKind,
    /// The offending line, if there was one, shortened.
    pub line: Option<String>,
}

/// How a side got ready for a rally: its agent is started if it is not running, and must answer `reset`. Times are in seconds and
/// do not include the opponent's. The start-up time is present if the agent had to be started.
#[derive(Debug, Clone, PartialEq)]
pub enum RallyReadiness {
    Ready {
        startup_s: Option<f64>,
        /// Interpolation of the agent's actions.
        interpolation: Interpolation,
        reset_s: f64,
    },
    /// The agent did not start, so the side's arm holds its position.
    StartFailed {
        /// Time until the failure.
        startup_s: f64,
        fault: SideFault,
    },
    /// The agent did not answer `reset` correctly, so the side's arm holds its position.
    ResetFailed {
        startup_s: Option<f64>,
        /// Interpolation stated by the agent.
        interpolation: Interpolation,
        /// Time until the failure.
        reset_s: f64,
        fault: SideFault,
    },
}

impl RallyReadiness {
    /// Total time for start-up and reset, in seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        match self {
            Self::Ready {
                startup_s, reset_s, ..
            }
            | Self::ResetFailed {
                startup_s, reset_s, ..
            } => startup_s.unwrap_or_default() + reset_s,
            Self::StartFailed { startup_s, .. } => *startup_s,
        }
    }

    /// The interpolation, if the agent stated one.
    #[must_use]
    pub const fn interpolation(&self) -> Option<Interpolation> {
        match self {
            Self::Ready { interpolation, .. } | Self::ResetFailed { interpolation, .. } => {
                Some(*interpolation)
            }
            Self::StartFailed { .. } => None,
        }
    }
}

/// A side's response in a control step.
#[derive(Debug, Clone, PartialEq)]
pub enum Response<'a> {
    /// An answer, possibly late.
    Answer {
        /// Row-major, finite, with the length that the interpolation requires.
        action: &'a [f64],
        /// Times of the answer.
        timing: AnswerTiming,
    },
    /// No valid answer: the side's arm holds its position until the end of the rally.
    Fault {
        fault: SideFault,
        /// Times until the fault.
        timing: AnswerTiming,
    },
    /// No answer was expected, since the side's arm holds its position after an earlier fault in this rally.
    Held,
}

/// The effect of a response on the side's arm in a control step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// The arm is commanded by the action.
    InTime,
    /// The answer was late: the arm holds its previous position.
    Late,
    /// There was no valid answer: the arm holds its previous position.
    Fault,
    /// No answer was expected after a fault in this rally: the arm holds its previous position until the end of the rally.
    Held,
}

impl Effect {
    pub const ALL: [Self; 4] = [Self::InTime, Self::Late, Self::Fault, Self::Held];

    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::InTime => "in_time",
            Self::Late => "late",
            Self::Fault => "fault",
            Self::Held => "held",
        }
    }
}

/// The start of a rally.
#[derive(Debug, Clone, Copy)]
pub struct RallyStart<'a> {
    /// Number of the rally, from 0.
    pub rally: u32,
    /// Control steps of the game before the rally.
    pub game_step: u32,
    /// The side in whose half the puck lies at the start.
    pub serving_side: Side,
    /// How the sides got ready.
    pub readiness: &'a [RallyReadiness; 2],
    /// The true initial state.
    pub state: &'a GameState,
}

/// A side's part in a control step.
#[derive(Debug, Clone, Copy)]
pub struct SideStep<'a> {
    /// The effect of its response.
    pub effect: Effect,
    /// The action of its answer, even if late.
    pub action: Option<&'a [f64]>,
    /// Times of the response, if an answer was expected.
    pub timing: Option<AnswerTiming>,
    /// Constraint values of its robot after the step; a constraint is violated if its value is above 0.
    pub constraints: ConstraintValues,
}

/// A control step. Its observations were passed to [`GameSink::observe`] before.
#[derive(Debug, Clone, Copy)]
pub struct GameStepRow<'a> {
    /// The game's control step, from 0.
    pub game_step: u32,
    pub rally: u32,
    /// Control step within the rally, from 0, as in the messages to agents.
    pub step: u32,
    pub sides: [SideStep<'a>; 2],
    /// The true state after the step.
    pub state: &'a GameState,
    /// Had the (simulated) puck tracking lost the puck after the step? This affects both sides.
    pub puck_lost: bool,
    /// Contacts of the puck that began in the step.
    pub impacts: &'a [Impact],
}

/// Why a rally ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RallyEnding {
    /// An event on the table.
    Table(RallyEnd),
    /// The game is over.
    GameOver,
}

impl RallyEnding {
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Table(RallyEnd::Goal { .. }) => "goal",
            Self::Table(RallyEnd::Foul { .. }) => "foul",
            Self::Table(RallyEnd::Stuck) => "stuck",
            Self::Table(RallyEnd::LeftTable) => "left_table",
            Self::Table(RallyEnd::Diverged { .. }) => "diverged",
            Self::GameOver => "game_over",
        }
    }

    /// The side that scored or committed the foul.
    #[must_use]
    pub fn responsible_side(self) -> Option<Side> {
        match self {
            Self::Table(RallyEnd::Goal { by } | RallyEnd::Foul { by }) => Some(Side::BOTH[by]),
            _ => None,
        }
    }
}

/// A finished rally.
#[derive(Debug, Clone, Copy)]
pub struct RallyRow<'a> {
    /// Number of the rally, from 0.
    pub rally: u32,
    pub steps: u32,
    /// Why it ended.
    pub ending: RallyEnding,
    /// The fault of each side in the rally; at most one per side.
    pub faults: [Option<&'a AgentFault>; 2],
    /// The score after the rally, including points for fouls.
    pub score: [u32; 2],
}

/// Receives the rallies and steps of a game, e.g. to record them.
pub trait GameSink {
    /// Starts a rally.
    ///
    /// # Errors
    /// If the recording could not be written.
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError>;
    /// The observations of both sides before the step, even of a side from which no answer is expected.
    fn observe(&mut self, observations: [&[f64]; 2]);
    /// The step after the observations.
    ///
    /// # Errors
    /// As [`Self::begin_rally`].
    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError>;
    /// Ends the rally.
    ///
    /// # Errors
    /// As [`Self::begin_rally`].
    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError>;
}

impl<S: GameSink + ?Sized> GameSink for &mut S {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        (**self).begin_rally(start)
    }
    fn observe(&mut self, observations: [&[f64]; 2]) {
        (**self).observe(observations);
    }
    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        (**self).step(row)
    }
    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        (**self).end_rally(row)
    }
}

impl GameSink for NullSink {
    fn begin_rally(&mut self, _: &RallyStart<'_>) -> Result<(), RecordError> {
        Ok(())
    }
    fn observe(&mut self, _: [&[f64]; 2]) {}
    fn step(&mut self, _: &GameStepRow<'_>) -> Result<(), RecordError> {
        Ok(())
    }
    fn end_rally(&mut self, _: &RallyRow<'_>) -> Result<(), RecordError> {
        Ok(())
    }
}
