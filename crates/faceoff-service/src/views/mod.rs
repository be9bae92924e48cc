//! How what can be known of a resource is made from the store and the scoring: one file per resource. Its types are
//! [`faceoff_api::views`].
//!
//! What may be told of a day's episodes follows from its release, the same for everybody. Who asks decides in one
//! file alone, `sight.rs`: of blind stages, whose scores the organiser sees, and of evaluations that are not public.

pub mod ablation;
pub mod ablation_clips;
pub mod announcement;
pub(crate) mod archived;
pub mod attempt;
pub mod board;
pub mod capacity;
pub mod clip_file;
pub mod clips;
pub mod comparison;
pub mod day;
mod division;
pub mod evaluation;
pub mod event;
pub mod feed;
pub(crate) mod finalised;
pub mod game;
pub mod game_clips;
pub mod game_live;
pub mod health;
pub mod history;
pub mod invitation;
pub mod me;
pub(crate) mod not_taken;
pub mod person;
pub mod proposal;
pub mod queue;
pub mod ratings;
pub mod replays;
pub mod ruling;
pub mod runtimes;
pub mod season;
pub mod sight;
pub mod stage;
mod standings;
pub mod storage;
pub mod submission;
pub mod team;
pub mod token;
pub mod tournament;
pub mod tournament_sheet;
pub mod trail;
pub mod violations;
pub mod webhook;
pub mod workers;
