//! What can be known of a resource, as it is answered: one file per resource. API and pages show these very types, and
//! the command line's client reads them.

pub mod ablation;
pub mod announcement;
pub mod archived;
pub mod attempt;
pub mod baseline;
pub mod board;
pub mod capacity;
pub mod certainty;
pub mod clips;
pub mod comparison;
pub mod day;
pub mod evaluation;
mod evaluation_status;
pub mod event;
pub mod finalised;
pub mod game;
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
pub mod ruling;
pub mod runtimes;
pub mod season;
pub mod stage;
pub mod storage;
pub mod submission;
pub mod task;
pub mod team;
pub mod token;
pub mod tournament;
pub mod violations;
pub mod webhook;
pub mod workers;

/// Text of agents as API and pages show it; what older versions have stored may hold anything.
#[must_use]
pub fn shown(text: String) -> String {
    faceoff_types::harmless(&text).into_owned()
}
