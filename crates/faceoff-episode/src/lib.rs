//! Runs *episodes* (one attempt of one agent at a task) and *games* (two agents against each other). The caller provides the agents'
//! answers, from a process, a recording or a function. The effects of answers and the content of recordings are decided in this crate
//! only.
//!
//! This crate starts no process, opens no file and reads no clock.

mod air_hockey;
mod record;
mod running_episode;
mod time_sum;
mod world;

pub use air_hockey::{
    AirHockeyWorld, Arena, Effect, FinishedGame, GameSink, GameStepRow, RallyEnding, RallyEntry,
    RallyRow, RallyStart, Response, RunningGame, SideFault, SideStep, action_space, describe_end,
    recording_columns,
};
pub use record::{AnswerTiming, EpisodeStart, NullSink, RecordError, StepRow, StepSink};
pub use running_episode::{NonFiniteObservation, Question, RunningEpisode};
pub use time_sum::TimeSum;
pub use world::{Conditions, Environment, Simulator, StateColumns, World};
