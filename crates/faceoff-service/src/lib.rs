//! What API and pages both do: who calls, what they may see, how an answer is made from store and scoring, what changes
//! the season, and how it is refused.
//!
//! It unpacks no bundle, runs no agent and computes no score: those are the workers' and `faceoff-scoring`'s. It reads
//! no clock and no environment that it was not given, and knows no route.

pub mod acts;
pub mod app;
pub mod archived;
pub mod auth;
pub mod conditions;
pub mod config;
pub mod csv;
pub mod ending;
pub mod episode_path;
pub mod extract;
mod kept;
mod kept_analyses;
pub mod kept_answers;
pub mod link_key;
pub mod network;
pub mod offer;
pub mod pace;
pub mod passwords;
pub mod problem;
pub mod rates;
pub mod release;
pub mod room;
pub mod session;
mod standing;
mod summaries;
pub mod text;
pub mod timeouts;
mod uploads;
pub mod viewer;
pub mod views;
pub mod watched;

/// What others await is boxed: the body of an `async fn` is compiled by each crate that awaits it, and by none before.
pub(crate) use async_recursion::async_recursion as boxed;
