//! Is the server up, and is it fit for work?

use crate::views::ruling::RulingView;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The server does all that it is for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct HealthView {
    /// Always `ok`; anything else is a problem with status 503.
    #[schema(example = "ok")]
    pub status: String,
    /// Version of the server.
    pub version: String,
    /// Units of work that are being done.
    pub running: u32,
    /// Units of work that could be begun.
    pub waiting: u32,
    /// The organiser holds the queue: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<RulingView>,
}

/// The process answers.
#[derive(Debug, Serialize, ToSchema)]
pub struct LiveView {
    /// Always `alive`.
    #[schema(example = "alive")]
    status: &'static str,
    /// Version of the server.
    version: &'static str,
}

impl LiveView {
    /// The process answers.
    pub const ALIVE: Self = Self {
        status: "alive",
        version: env!("CARGO_PKG_VERSION"),
    };
}
