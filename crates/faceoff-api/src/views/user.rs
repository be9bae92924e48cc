//! Users, and the calling user or API client.

use crate::views::{team::TeamView, token::TokenView};
use faceoff_types::{TeamId, UserId, UserName};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A user: an organiser, or a member of a team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct UserView {
    /// Id of the user.
    pub id: UserId,
    /// The user's name, with which the user also signs in.
    pub name: UserName,
    /// `organiser` or `member`.
    #[schema(example = "member")]
    pub role: String,
    /// The member's team; null for organisers.
    pub team: Option<TeamId>,
    /// When the user accepted the invitation.
    pub joined_at: Timestamp,
    /// Since when the account is closed; null while it is active.
    pub left_at: Option<Timestamp>,
    /// The accepted version of the terms; null if none was accepted.
    pub accepted_terms: Option<u32>,
}

/// The caller: the user or API client that sent the request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CallerView {
    /// `organiser`, `member`, `team` (an API client with a team's token) or `host` (the server's operator, with the
    /// token in the file `admin-token` and an organiser's rights).
    #[schema(example = "member")]
    pub role: String,
    /// The user; null for a team's API client and the operator.
    pub person: Option<UserView>,
    /// The caller's team; null for organisers and the operator.
    pub team: Option<TeamView>,
    /// The token or session of the request.
    pub token: TokenView,
}
