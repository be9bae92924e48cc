//! What can be known of a resource, and how it is made from the store and the scoring: one file per
//! resource. API and pages show these very types, and the command line's client reads them.
//!
//! What may be told of a day's episodes follows from its release, the same for everybody. Who asks decides in one
//! file alone, `sight.rs`: of blind stages, whose scores the organiser sees, and of evaluations that are not public.

pub mod ablation;
pub(crate) mod ablation_clips;
pub mod announcement;
pub mod archived;
pub mod attempt;
pub mod baseline;
pub mod board;
mod board_csv;
pub mod capacity;
pub mod certainty;
pub(crate) mod clip_file;
pub(crate) mod clips;
pub mod comparison;
pub mod day;
mod division;
pub mod evaluation;
mod evaluation_status;
pub mod event;
pub(crate) mod feed;
pub mod finalised;
pub mod game;
pub(crate) mod game_clips;
pub(crate) mod game_live;
pub mod health;
pub mod history;
pub mod invitation;
pub mod link;
pub mod live;
pub mod me;
pub mod not_taken;
pub mod person;
pub mod proposal;
pub mod queue;
pub(crate) mod ratings;
pub(crate) mod replays;
pub mod ruling;
pub mod runtimes;
pub mod season;
pub(crate) mod sight;
pub mod stage;
mod standings;
pub mod storage;
pub mod submission;
pub mod task;
pub mod team;
pub mod token;
pub mod tournament;
pub(crate) mod tournament_sheet;
pub(crate) mod trail;
pub mod violations;
pub mod webhook;
pub mod workers;

/// Text of agents as API and pages show it; what older versions have stored may hold anything.
fn shown(text: String) -> String {
    faceoff_types::harmless(&text).into_owned()
}
