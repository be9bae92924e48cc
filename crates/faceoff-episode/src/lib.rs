//! Plays episodes and games from answers, wherever they come from: a process, a recording, a program in the same
//! address space. What an episode or a game leads to and what is recorded of it is decided here, once.
//!
//! This crate starts no process, opens no file and reads no clock.

mod arena;
mod course;
mod game_course;
mod game_record;
mod game_side;
mod record;
mod time_sum;
mod why;

pub use arena::Arena;
pub use course::{Course, NotFinite, Question};
pub use game_course::{FinishedGame, GameCourse};
pub use game_record::{
    Effect, Entry, GameSink, GameStepRow, RallyEnding, RallyRow, RallyStart, Response, SideFault,
    SideStep,
};
pub use record::{Answered, EpisodeStart, Nowhere, RecordError, StepRow, StepSink};
pub use time_sum::TimeSum;
pub use why::why_it_ended;
