//! New, changed and ended access: users and tokens, with the credentials (tokens, invitations, webhooks) that ended with them.

use crate::views::{
    invitation::InvitationView,
    token::TokenView,
    user::{CallerView, UserView},
    webhook::WebhookView,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What ended beside the user's own tokens and sessions, and what stays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EndedCredentialsView {
    /// Revoked tokens of teams and of the host.
    pub tokens: Vec<TokenView>,
    /// Revoked invitations.
    pub invitations: Vec<InvitationView>,
    /// Disabled webhooks. They can be enabled again.
    pub webhooks: Vec<WebhookView>,
    /// Users who joined by invitations of the user. Their accounts stay: close them, if they are unknown to you.
    pub remaining_people: Vec<UserView>,
}

/// A revoked token.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RevokedTokenView {
    /// The token.
    #[serde(flatten)]
    pub token: TokenView,
    /// What was made with the token and ended with it; absent if there was nothing, or if you revoked your own token.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndedCredentialsView>,
}

/// A user whose access has changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChangedAccessView {
    /// The user.
    #[serde(flatten)]
    pub user: UserView,
    /// What the user had made and what ended, too; absent if there was nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndedCredentialsView>,
}

/// A new user with a new token, which is shown only once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct NewAccountView {
    /// The user, as a caller.
    #[serde(flatten)]
    pub caller: CallerView,
    /// The bearer token; the server stores only its hash.
    #[schema(example = "fo_person_…")]
    pub secret: String,
    /// What a user who gets access again had made, and what ended now; absent if there was nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndedCredentialsView>,
}
