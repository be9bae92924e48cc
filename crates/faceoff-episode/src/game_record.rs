//! What goes into a game from outside, and what is recorded of it. Pairs are the first side's first.

use crate::record::{Answered, Nowhere, RecordError};
use faceoff_sim::{ConstraintValues, GameState, Impact, RallyEnd};
use faceoff_types::{AgentFault, AgentFaultKind, Interpolation, Side};

/// What a side did wrong, before anybody has said where.
#[derive(Debug, Clone, PartialEq)]
pub struct SideFault {
    pub kind: AgentFaultKind,
    /// The offending line, cut, where there was one.
    pub line: Option<String>,
}

/// What came of a side's getting ready for a rally. Times are its own, in seconds; a start-up is there only
/// if it had to be started.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    Plays {
        startup_s: Option<f64>,
        /// What its actions mean.
        interpolation: Interpolation,
        reset_s: f64,
    },
    /// It did not start: its arm holds.
    FailedToStart {
        /// Until it was given up.
        startup_s: f64,
        fault: SideFault,
    },
    /// It did not get ready: its arm holds.
    FailedToReset {
        startup_s: Option<f64>,
        /// What its actions would have meant.
        interpolation: Interpolation,
        /// Until it was given up.
        reset_s: f64,
        fault: SideFault,
    },
}

impl Entry {
    /// All of its time, in seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        match self {
            Self::Plays {
                startup_s, reset_s, ..
            }
            | Self::FailedToReset {
                startup_s, reset_s, ..
            } => startup_s.unwrap_or_default() + reset_s,
            Self::FailedToStart { startup_s, .. } => *startup_s,
        }
    }

    /// What its actions mean, if it got as far as to say.
    #[must_use]
    pub const fn interpolation(&self) -> Option<Interpolation> {
        match self {
            Self::Plays { interpolation, .. } | Self::FailedToReset { interpolation, .. } => {
                Some(*interpolation)
            }
            Self::FailedToStart { .. } => None,
        }
    }
}

/// What came from a side in a control step.
#[derive(Debug, Clone, PartialEq)]
pub enum Response<'a> {
    /// An answer, in time or not.
    Answer {
        /// Row-major, of the interpolation's length, finite.
        action: &'a [f64],
        /// How long it took.
        answered: Answered,
    },
    /// No answer that is one: from now on its arm holds, to the rally's end.
    Fault {
        fault: SideFault,
        /// For how long it was waited for.
        answered: Answered,
    },
    /// It was not asked: its arm holds since an earlier fault in this rally.
    Held,
}

/// Which command took effect in a control step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    InTime,
    /// The answer came too late: the previous position, at rest.
    Late,
    /// There was no answer: the previous position, at rest.
    Fault,
    /// There was no question: the previous position, at rest.
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

/// How a rally begins.
#[derive(Debug, Clone, Copy)]
pub struct RallyStart<'a> {
    /// From 0.
    pub rally: u32,
    /// Control steps that the game has played before.
    pub game_step: u32,
    /// On whose side the puck lies.
    pub serves: Side,
    /// What came of getting ready.
    pub entries: &'a [Entry; 2],
    /// The true initial state.
    pub state: &'a GameState,
}

/// A side's part in a control step.
#[derive(Debug, Clone, Copy)]
pub struct SideStep<'a> {
    /// Which command took effect.
    pub effect: Effect,
    /// What it answered, if it did, also too late.
    pub action: Option<&'a [f64]>,
    /// How long it was waited for, if it was asked.
    pub answered: Option<Answered>,
    /// Its robot's constraints after the step; violated when above 0.
    pub constraints: ConstraintValues,
}

/// A control step; the observations were given before.
#[derive(Debug, Clone, Copy)]
pub struct GameStepRow<'a> {
    /// The game's control step, from 0.
    pub game_step: u32,
    pub rally: u32,
    /// The rally's control step, from 0: the one that agents are told.
    pub step: u32,
    /// What each side did.
    pub sides: [SideStep<'a>; 2],
    /// The true state after the step.
    pub state: &'a GameState,
    /// Had tracking lost the puck after the step, for both?
    pub puck_lost: bool,
    /// The contacts of the puck that began in the step.
    pub impacts: &'a [Impact],
}

/// Why a rally is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RallyEnding {
    /// By what happened on the table.
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

    /// The side that scored or fouled.
    #[must_use]
    pub fn by(self) -> Option<Side> {
        match self {
            Self::Table(RallyEnd::Goal { by } | RallyEnd::Foul { by }) => Some(Side::BOTH[by]),
            _ => None,
        }
    }
}

/// A rally that is over.
#[derive(Debug, Clone, Copy)]
pub struct RallyRow<'a> {
    /// From 0.
    pub rally: u32,
    pub steps: u32,
    /// Why it is over.
    pub ending: RallyEnding,
    /// The fault of each side in it; there is at most one.
    pub faults: [Option<&'a AgentFault>; 2],
    /// The final score so far, points for fouls included.
    pub score: [u32; 2],
}

/// Where a game's course goes.
pub trait GameSink {
    /// A rally begins.
    ///
    /// # Errors
    /// It could not be recorded; so of the others.
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError>;
    /// What both sides observe before the step, whether they are asked or not.
    fn observe(&mut self, observations: [&[f64]; 2]);
    /// The step that followed.
    ///
    /// # Errors
    /// As [`Self::begin_rally`].
    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError>;
    /// The rally is over.
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

impl GameSink for Nowhere {
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
