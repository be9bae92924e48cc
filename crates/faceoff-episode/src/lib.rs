//! Runs episodes and games from answers, which may come from a process, a recording or a function. The effects of answers
//! and the content of recordings are decided here, and only here.
//!
//! This crate starts no process, opens no file and reads no clock.

mod arena;
mod running_episode;
mod running_game;
mod game_record;
mod running_side;
mod record;
mod time_sum;
mod end_description;

pub use arena::Arena;
pub use running_episode::{RunningEpisode, NonFiniteObservation, Question};
pub use running_game::{FinishedGame, RunningGame};
pub use game_record::{
    Effect, RallyEntry, GameSink, GameStepRow, RallyEnding, RallyRow, RallyStart, Response, SideFault,
    SideStep,
};
pub use record::{AnswerTiming, EpisodeStart, NullSink, RecordError, StepRow, StepSink};
pub use time_sum::TimeSum;
pub use end_description::describe_end;
