//! Tokens and sessions, without their secrets.

use faceoff_types::{TeamId, TokenId, UserId};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// An API token, or a browser's session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TokenView {
    /// Id of the token; does not reveal its secret.
    pub id: TokenId,
    /// The owner's name for it.
    pub name: String,
    /// `key` for an API token, `session` for a browser's session.
    #[schema(example = "key")]
    pub kind: String,
    /// The team that it acts for, if it is a team's token; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub team: Option<TeamId>,
    /// The user that it acts for, if it is a user's token. Without `team` and `person` it is the operator's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<UserId>,
    /// The user who made it or rotated it last; null: the operator, or the server.
    pub made_by: Option<UserId>,
    /// When it was created.
    pub created_at: Timestamp,
    /// When it expires; null: never.
    pub expires_at: Option<Timestamp>,
    /// When it was last used, to the minute; null: never.
    pub last_used_at: Option<Timestamp>,
    /// When it was revoked; null while it is valid.
    pub revoked_at: Option<Timestamp>,
}

/// A new token, which is shown only once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewTokenView {
    /// The token's metadata.
    #[serde(flatten)]
    pub token: TokenView,
    /// The bearer token; the server stores only its hash.
    #[schema(example = "fo_person_…")]
    pub secret: String,
}
