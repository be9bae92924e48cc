//! Builds response bodies from the store and the scoring, one file per resource. Their types are in
//! [`faceoff_api::views`].
//!
//! Data about the episodes of an evaluation day becomes visible with the day's release, for everyone at once. Restrictions that
//! depend on the viewer (scores of blind stages, evaluations that are not public) are decided only in [`visibility`].

pub mod ablation;
pub mod ablation_clips;
pub mod announcement;
pub(crate) mod archive;
pub mod attempt;
pub mod board;
mod board_rows;
pub mod board_timeline;
pub mod capacity;
pub mod clip_file;
pub mod clips;
pub mod comparison;
pub mod credentials;
pub mod day;
pub mod decision;
mod division;
pub mod evaluation;
pub mod event;
pub(crate) mod exclusions;
pub mod feed;
pub mod game;
pub mod game_clips;
pub mod health;
pub mod highlight;
pub mod history;
pub mod invitation;
pub mod live_game;
pub mod me;
pub mod pending_decisions;
pub mod proposal;
pub mod queue;
pub mod ratings;
pub mod runtimes;
pub mod schedule_replays;
pub mod season;
pub(crate) mod sign_off;
pub mod stage;
pub mod storage;
pub mod submission;
pub mod team;
pub mod token;
pub mod tournament;
pub mod tournament_state;
pub mod user;
pub mod violations;
pub mod visibility;
pub mod webhook;
pub mod workers;
