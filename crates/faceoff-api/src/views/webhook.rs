//! Webhooks, without their secrets, and their deliveries. A webhook is an HTTP address that a team or the organisers
//! registered; the server sends it a message, the *delivery*, for each event that its filters match.

use faceoff_types::{DeliveryId, TeamId, WebhookId, deprecated_names};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A webhook: an address to which events are delivered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WebhookView {
    /// Id of the webhook.
    pub id: WebhookId,
    /// The team that owns it; absent for the organisers' webhooks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// The owner's name for it.
    pub name: String,
    /// Address that receives the deliveries.
    pub url: String,
    /// Filters of the delivered events; empty: all events that the owner may see.
    pub about: Vec<String>,
    /// When it was created.
    pub created_at: Timestamp,
    /// Until when the previous secret also signs deliveries; absent after that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub old_secret_until: Option<Timestamp>,
    /// Whether deliveries succeed.
    #[serde(flatten)]
    pub state: WebhookState,
}

/// State of a webhook.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum WebhookState {
    /// The last delivery succeeded, or there was none yet.
    Alive,
    /// Deliveries fail and are retried.
    Failing {
        /// Time of the first failure.
        since: Timestamp,
    },
    /// Deliveries have stopped until the owner reactivates the webhook.
    Dead {
        /// When deliveries stopped.
        since: Timestamp,
        /// Why they stopped.
        reason: String,
    },
}

/// A webhook with its secret, which is shown only once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewWebhookView {
    /// The webhook.
    #[serde(flatten)]
    pub webhook: WebhookView,
    /// Secret with which the receiver verifies signatures, as Standard Webhooks defines them.
    #[schema(example = "whsec_…")]
    pub secret: String,
}

/// A delivery to a webhook.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveryView {
    /// Value of the header `webhook-id`, the same in every attempt.
    pub id: DeliveryId,
    /// Id of the event; absent for a test delivery.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub event: Option<i64>,
    /// Kind of the event; `test` for a test delivery.
    #[schema(example = "day_released")]
    pub kind: String,
    /// When the delivery was created.
    pub created_at: Timestamp,
    /// Number of attempts so far.
    pub attempts: u32,
    /// The last attempt; absent before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<DeliveryAttemptView>,
    /// State of the delivery.
    #[serde(flatten)]
    pub state: DeliveryStateView,
}

/// An attempt to deliver an event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveryAttemptView {
    /// When it was made.
    pub at: Timestamp,
    /// HTTP status of the response; null without a response.
    pub status: Option<u16>,
    /// What went wrong; null on success.
    pub error: Option<String>,
}

/// State of a delivery.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(remote = "Self", tag = "state", rename_all = "snake_case")]
pub enum DeliveryStateView {
    /// Waiting for the first or next attempt.
    Waiting {
        /// Time of the next attempt.
        next_at: Timestamp,
    },
    /// The receiver accepted it.
    Delivered {
        /// When it was accepted.
        ended_at: Timestamp,
    },
    /// No further attempts are made.
    GivenUp {
        /// When it was given up.
        ended_at: Timestamp,
    },
}
deprecated_names!(DeliveryStateView { settled_at => ended_at });
