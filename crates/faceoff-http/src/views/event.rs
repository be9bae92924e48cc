//! What happened, as the organiser reads it.

use faceoff_store::EventRecord;
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
    /// `organiser`, `team:ID`, `schedule`, `worker:NAME` or `server`.
    #[schema(example = "organiser")]
    pub actor: String,
    /// `season`, or kind and id: `stage:ID`, `day:STAGE/2026-03-01`, `team:ID`, `submission:ID`, `evaluation:ID`, `ablation:ID`.
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

impl From<EventRecord> for EventView {
    fn from(record: EventRecord) -> Self {
        let mut details = match serde_json::to_value(&record.event) {
            Ok(Value::Object(details)) => details,
            _ => Map::new(),
        };
        let kind = match details.remove("kind") {
            Some(Value::String(kind)) => kind,
            _ => String::new(),
        };
        Self {
            id: record.id,
            at: record.at,
            actor: record.actor.to_string(),
            subject: record.subject.to_string(),
            kind,
            details,
        }
    }
}
