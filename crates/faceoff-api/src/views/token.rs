//! Tokens and sessions, without what would open anything.

use faceoff_types::{PersonId, TeamId, TokenId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A token, or the session of a browser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TokenView {
    /// Names it; tells nothing of the token.
    pub id: TokenId,
    /// What its owner calls it.
    pub name: String,
    /// `key`, or `session` of a browser.
    #[schema(example = "key")]
    pub kind: String,
    /// Whose programs it is for, if it is a team's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// For whom it speaks, if it is a person's; without both it is the host's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<PersonId>,
    /// When it was made.
    pub created_at: Timestamp,
    /// From then on it is worth nothing; null: it has no end.
    pub expires_at: Option<Timestamp>,
    /// To the minute; null: never.
    pub last_used_at: Option<Timestamp>,
    /// Since when it is worth nothing; null: it is good.
    pub revoked_at: Option<Timestamp>,
}

/// A new token, which is shown this once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewTokenView {
    /// What is stored of it.
    #[serde(flatten)]
    pub token: TokenView,
    /// The bearer token; only its hash is stored.
    #[schema(example = "fo_person_…")]
    pub secret: String,
}
