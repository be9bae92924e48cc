//! The event log, as organisers read it. It lists every change of the season with its *actor* (who or what made it) and its
//! *subject* (what was changed).

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

/// An event: a change of the season, and its actor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EventView {
    /// Increases with every event, in the order in which they were stored.
    pub id: i64,
    /// When it happened.
    pub at: Timestamp,
    /// Who or what made the change: `organiser` (the server's operator, who holds the file `admin-token`),
    /// `person:ID`, `team:ID`, `visitor`, `schedule`, `worker:NAME` or `server`.
    #[schema(example = "organiser")]
    pub actor: String,
    /// Name of the user or the team; absent for other actors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub actor_name: Option<String>,
    /// What was changed: `season`, or kind and id: `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`, `evaluation:ID`,
    /// `ablation:ID`, `person:ID`, `registration:ID`, `announcement:ID`, `question:ID`, `proposal:ID`, `tournament:ID`,
    /// `game:ID`.
    #[schema(example = "day:2026-03-01")]
    pub subject: String,
    /// Kind of the event.
    #[schema(example = "day_started")]
    pub kind: String,
    /// Details; their fields depend on the kind.
    #[schema(value_type = Object)]
    pub details: Map<String, Value>,
}

/// A page of events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EventsView {
    /// Newest first.
    pub events: Vec<EventView>,
    /// Value of `before` for the next page; null on the last page.
    pub next_before: Option<i64>,
}
