//! About webhooks.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A webhook to make.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewWebhook {
    /// What it is for: 1 to 80 characters.
    pub name: String,
    /// Where it is: an address on the Internet that begins with `https://`.
    #[schema(example = "https://example.org/faceoff")]
    pub url: String,
    /// What it is told of: topics (`board`, `queue`, …), subjects (`stage:ID`, …) and names of events (`day_released`), 50
    /// at most; left out or empty, everything that its owner may know of.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<String>,
}

/// What is to be otherwise of a webhook; what is left out stays.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WebhookChanges {
    /// What it is for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Where it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// What it is told of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<Vec<String>>,
    /// Tells one that is dead again, of what happens from now on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<Revived>,
}

/// How a webhook that is dead is to stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Revived {
    /// It is told of what happens.
    Alive,
}
