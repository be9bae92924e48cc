//! What happened, as the organiser reads it.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

/// A change, and who made it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EventView {
    /// Rises with every change, in the order in which they were stored.
    pub id: i64,
    /// When it was.
    pub at: Timestamp,
    /// `organiser` (the host), `person:ID`, `team:ID`, `visitor`, `schedule`, `worker:NAME` or `server`.
    #[schema(example = "organiser")]
    pub actor: String,
    /// The name of the person or the team; absent of others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actor_name: Option<String>,
    /// `season`, or kind and id: `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`, `evaluation:ID`, `ablation:ID`,
    /// `person:ID`, `registration:ID`, `announcement:ID`, `question:ID`, `proposal:ID`, `tournament:ID`, `game:ID`.
    #[schema(example = "day:2026-03-01")]
    pub subject: String,
    /// What happened.
    #[schema(example = "day_started")]
    pub kind: String,
    /// What else is known of it; by the kind.
    #[schema(value_type = Object)]
    pub details: Map<String, Value>,
}

/// A page of events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EventsView {
    /// The newest first.
    pub events: Vec<EventView>,
    /// The value of `before` that gives the next page; null on the last.
    pub next_before: Option<i64>,
}
