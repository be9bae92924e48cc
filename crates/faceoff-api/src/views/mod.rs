//! Response bodies, one file per resource. The API and the pages show these types, and the command line's client reads
//! them.

pub mod ablation;
pub mod announcement;
pub mod archive;
pub mod attempt;
pub mod baseline;
pub mod board;
pub mod capacity;
pub mod champion_shares;
pub mod comparison;
pub mod credentials;
pub mod day;
pub mod decision;
pub mod episodes;
pub mod evaluation;
mod evaluation_status;
pub mod event;
pub mod exclusion;
pub mod game;
pub mod health;
pub mod history;
pub mod invitation;
pub mod link;
pub mod live;
pub mod me;
pub mod partial_upload;
pub mod proposal;
pub mod queue;
pub mod runtimes;
pub mod season;
pub mod sign_off;
pub mod stage;
pub mod storage;
pub mod submission;
pub mod task;
pub mod team;
pub mod token;
pub mod tournament;
pub mod user;
pub mod violations;
pub mod webhook;
pub mod workers;

/// Text that an agent or a user wrote, with control characters escaped. Text that older versions stored may contain any.
#[must_use]
pub fn printable(text: String) -> String {
    faceoff_types::escape_unprintable(&text).into_owned()
}
