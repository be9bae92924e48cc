//! The logic that API and pages share: authentication, visibility, response bodies built from store and scoring, changes
//! of the season, and error responses.
//!
//! This crate unpacks no bundle, runs no agent and computes no score; workers and `faceoff-scoring` do. It reads no clock
//! and no environment that is not passed in, and defines no routes.

pub mod agent_resources;
mod aggregated_rows;
pub mod answer_cache;
pub mod api_document;
// The state that all request handlers share.
pub mod app;
pub mod archive_contents;
pub mod auth;
pub mod change_quota;
pub mod config;
pub mod content_negotiation;
pub mod credential;
pub mod csv;
pub mod day_release;
pub mod download;
pub mod episode_path;
// Extractors of bodies, forms, queries and path parameters.
pub mod extract;
pub mod free_space;
pub mod highlight;
pub mod link_key;
// Networks of IP addresses, by which limits per client count.
pub mod network;
mod partial_uploads;
pub mod passwords;
pub mod priority_permits;
pub mod problem;
pub mod rate_limits;
mod recent_callers;
pub mod request_log;
pub mod request_preconditions;
pub mod services;
pub mod session;
mod shared_cache;
pub mod shutdown;
mod summaries;
// Validation of text from users.
pub mod text;
pub mod timeouts;
pub mod transfer_rate;
mod upload_slots;
// Who views a public resource: organiser, team or visitor.
pub mod viewer;
pub mod views;

/// `#[boxed_future]` on an `async fn` that other crates await makes it return a boxed future. Without it each of these crates would
/// compile the body.
pub(crate) use async_recursion::async_recursion as boxed_future;
