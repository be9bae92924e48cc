//! Liveness and readiness of the server: whether its process responds, and whether it can also serve requests and run jobs.

use crate::views::decision::DecisionView;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Readiness: the server serves requests and can run jobs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct HealthView {
    /// Always `ok`; otherwise the response is a problem with status 503.
    #[schema(example = "ok")]
    pub status: String,
    /// Version of the server.
    pub version: String,
    /// Running jobs.
    pub running: u32,
    /// Pending jobs that could start.
    pub waiting: u32,
    /// If an organiser paused the queue: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<DecisionView>,
}

/// Liveness: the server process responds.
#[derive(Debug, Serialize, ToSchema)]
pub struct LiveView {
    /// Always `alive`.
    #[schema(example = "alive")]
    status: &'static str,
    /// Version of the server.
    version: &'static str,
}

impl LiveView {
    /// The only value.
    pub const ALIVE: Self = Self {
        status: "alive",
        version: env!("CARGO_PKG_VERSION"),
    };
}
