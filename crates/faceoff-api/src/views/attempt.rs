//! Attempts at a game. Each start on a slot (a place of a worker in which one job runs) is an attempt, whatever its outcome.

use faceoff_types::deprecated_names;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An attempt at a game: one start on a slot, whatever its outcome.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self")]
pub struct GameAttemptView {
    /// From 1.
    pub number: u32,
    /// The slot that ran it.
    pub worker: String,
    /// When it started.
    pub started_at: Timestamp,
    /// When it ended; null while it is running.
    pub ended_at: Option<Timestamp>,
    /// Its outcome; null while it is running.
    pub end: Option<AttemptOutcomeView>,
    /// What went wrong, or why the result was voided; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}
deprecated_names!(GameAttemptView { begun_at => started_at });

/// Outcome of an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AttemptOutcomeView {
    /// A result. It counts unless it is voided.
    Played,
    /// A platform fault.
    #[serde(rename = "broken")]
    PlatformFailed,
    /// The slot was shut down or lacked disk space. The attempt does not count towards the game's limit of attempts.
    #[serde(rename = "given_back")]
    Released,
    /// The slot's process ended, or its lease expired.
    Lost,
    /// The game was cancelled while it was running.
    #[serde(rename = "called_off")]
    Cancelled,
}
