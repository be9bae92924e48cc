//! Runs *episodes* (one attempt of one agent at a task) and *games* (two agents against each other). The caller provides the agents'
//! answers, from a process, a recording or a function. The effects of answers and the content of recordings are decided in this crate
//! only.
//!
//! This crate starts no process, opens no file and reads no clock.

mod arena;
mod end_description;
mod game_record;
mod record;
mod running_episode;
mod running_game;
mod running_side;
mod time_sum;

pub use arena::Arena;
pub use end_description::describe_end;
pub use game_record::{
    Effect, GameSink, GameStepRow, RallyEnding, RallyEntry, RallyRow, RallyStart, Response,
    SideFault, SideStep,
};
pub use record::{AnswerTiming, EpisodeStart, NullSink, RecordError, StepRow, StepSink};
pub use running_episode::{NonFiniteObservation, Question, RunningEpisode};
pub use running_game::{FinishedGame, RunningGame};
pub use time_sum::TimeSum;
