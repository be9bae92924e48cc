//! Runs *episodes* (one attempt of one agent at a task) in the world of a competition. The caller provides the agent's answers, from a
//! process, a recording or a function. The course of an episode is decided in this crate only.
//!
//! This crate starts no process, opens no file and reads no clock.

mod record;
mod running_episode;
mod time_sum;
mod world;

pub use record::{AnswerTiming, EpisodeStart, NullSink, RecordError, StepRow, StepSink};
pub use running_episode::{ActionRequest, NonFiniteObservation, RunningEpisode};
pub use time_sum::TimeSum;
pub use world::{Conditions, InvalidConditions, Simulator, StateColumns, World, WorldFactory};
