//! Requests about webhooks. A webhook is an Internet address to which the server sends events; it is *dead* once deliveries
//! have failed for too long.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A webhook to create.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewWebhook {
    /// What the webhook is used for. 1 to 80 characters.
    pub name: String,
    /// Public Internet address that receives the deliveries; begins with `https://`.
    #[schema(example = "https://example.org/faceoff")]
    pub url: String,
    /// Filters; an event is delivered if it matches one of them: topics (`board`, `queue`, …), subjects (`stage:ID`, …)
    /// and event kinds (`day_released`). At most 50. Default: all events that the owner may see.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<String>,
}

/// Changes of a webhook. Fields that are left out stay as they are.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WebhookChanges {
    /// What the webhook is used for. 1 to 80 characters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Public Internet address that receives the deliveries; begins with `https://`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// Filters of the delivered events; at most 50. An empty list: all events that the owner may see.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<Vec<String>>,
    /// Reactivates a dead webhook. It receives events from now on; missed ones are not sent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<WebhookRevival>,
}

/// The only state that a request can set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WebhookRevival {
    /// The webhook receives events.
    Alive,
}
