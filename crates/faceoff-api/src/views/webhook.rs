//! Webhooks, without what signs, and what came of their deliveries.

use faceoff_types::{DeliveryId, TeamId, WebhookId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An address that is told of what happens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WebhookView {
    /// Names it.
    pub id: WebhookId,
    /// Whose; absent: the organisers'.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// What its owner calls it.
    pub name: String,
    /// Where it is.
    pub url: String,
    /// What it is told of; empty: everything that its owner may know of.
    pub about: Vec<String>,
    /// When it was made.
    pub created_at: Timestamp,
    /// Until when the secret before this one signs, too; absent: no other does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub old_secret_until: Option<Timestamp>,
    /// Does it take what it is told?
    #[serde(flatten)]
    pub state: WebhookState,
}

/// How a webhook stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum WebhookState {
    /// It took what it was told last, or was told nothing yet.
    Alive,
    /// It has taken nothing since then; what it was told is sent again.
    Failing {
        /// Since when.
        since: Timestamp,
    },
    /// It is told nothing any more, until it is changed to be alive.
    Dead {
        /// Since when.
        since: Timestamp,
        /// Why.
        reason: String,
    },
}

/// A webhook with its secret, which is shown this once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewWebhookView {
    /// What can be read of it later.
    #[serde(flatten)]
    pub webhook: WebhookView,
    /// With what the receiver checks signatures, by the Standard Webhooks.
    #[schema(example = "whsec_…")]
    pub secret: String,
}

/// One thing told to a webhook.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveryView {
    /// As the receiver reads it in the header `webhook-id`, however often it is sent.
    pub id: DeliveryId,
    /// The id of the event; absent: a test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub event: Option<i64>,
    /// What happened, by name; `test`, if nothing has.
    #[schema(example = "day_released")]
    pub kind: String,
    /// When it was noted.
    pub created_at: Timestamp,
    /// So often it was sent.
    pub attempts: u32,
    /// What came of the last time; absent before the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<AttemptView>,
    /// How it stands.
    #[serde(flatten)]
    pub state: DeliveryStateView,
}

/// What came of sending something.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AttemptView {
    /// When.
    pub at: Timestamp,
    /// The status that was answered; null: there was no answer.
    pub status: Option<u16>,
    /// What was wrong; null: nothing.
    pub error: Option<String>,
}

/// How something told to a webhook stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum DeliveryStateView {
    /// It is sent, again.
    Waiting {
        /// When.
        next_at: Timestamp,
    },
    /// It was taken.
    Delivered {
        /// When.
        settled_at: Timestamp,
    },
    /// It is not sent any more.
    GivenUp {
        /// Since when.
        settled_at: Timestamp,
    },
}
