//! New, changed and ended access: users and tokens, with the credentials (tokens, invitations, webhooks) that ended with them.

use crate::views::{
    invitation::InvitationView,
    token::TokenView,
    user::{CallerView, UserView},
    webhook::WebhookView,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// What ended beside the token itself, or beside the user's own tokens and sessions; and which accounts stay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EndedCredentialsView {
    /// Revoked tokens.
    pub tokens: Vec<TokenView>,
    /// Revoked invitations.
    pub invitations: Vec<InvitationView>,
    /// Disabled webhooks. They can be enabled again; check the address and rotate the secret before.
    pub webhooks: Vec<WebhookView>,
    /// Users who joined by these invitations, or by invitations of such users. Their accounts stay: close those that you do not know.
    pub remaining_people: Vec<UserView>,
    /// Users who got access again by a link of this user. Their accounts stay: unless it was they who asked for it, make a new link for
    /// them (the role `return`), which ends everything else.
    #[serde(default)]
    pub restored_people: Vec<UserView>,
}

impl EndedCredentialsView {
    /// What ended and what stays, a line each, for people.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let tokens = self.tokens.iter();
        let invitations = self.invitations.iter();
        let webhooks = self.webhooks.iter();
        let remaining = self.remaining_people.iter();
        let restored = self.restored_people.iter();
        tokens
            .map(|token| format!("revoked: token {} ({})", token.name, token.id))
            .chain(invitations.map(|invitation| {
                format!("revoked: invitation for {} ({})", invitation.note, invitation.id)
            }))
            .chain(webhooks.map(|webhook| {
                format!(
                    "disabled: webhook {} ({}); before you enable it again, check its address and rotate its secret",
                    webhook.name, webhook.id
                )
            }))
            .chain(remaining.map(|user| {
                format!("stays: the account of {}, who joined by such an invitation", user.name)
            }))
            .chain(restored.map(|user| {
                format!(
                    "stays: the account of {0}, who got access again by such a link; unless {0} asked for it, make a new link",
                    user.name
                )
            }))
            .collect()
    }
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
