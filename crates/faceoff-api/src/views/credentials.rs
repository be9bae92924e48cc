//! New, changed and ended access: users and tokens, with the credentials (tokens, invitations, webhooks) that ended with them.

use crate::views::{
    invitation::InvitationView,
    token::TokenView,
    user::{CallerView, UserView},
    webhook::WebhookView,
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Credentials that ended together with a revoked token, or with a user's tokens and sessions; and the accounts that stay.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EndedCredentialsView {
    /// Revoked tokens.
    pub tokens: Vec<TokenView>,
    /// Revoked invitations.
    pub invitations: Vec<InvitationView>,
    /// Disabled webhooks. They can be enabled again; check the address and rotate the secret before.
    pub webhooks: Vec<WebhookView>,
    /// Users who joined by these invitations, or by invitations of such users. Their accounts stay: close those that you do not know.
    #[serde(rename = "remaining_people")]
    pub remaining_users: Vec<UserView>,
    /// Users who got access again by a link (an invitation with the role `return`) of this user. Their accounts stay. If such a user
    /// did not ask for the link, make a new one: accepting it ends the credentials made before.
    #[serde(rename = "restored_people", default)]
    pub restored_users: Vec<UserView>,
}

impl EndedCredentialsView {
    /// What ended and what stays, a line each, for people.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let tokens = self.tokens.iter();
        let invitations = self.invitations.iter();
        let webhooks = self.webhooks.iter();
        let remaining = self.remaining_users.iter();
        let restored = self.restored_users.iter();
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
                format!("stays: the account of {}, who joined by an invitation made with the ended credentials", user.name)
            }))
            .chain(restored.map(|user| {
                format!(
                    "stays: the account of {0}, who got access again by a link made with the ended credentials; \
                     unless {0} asked for that link, make a new one",
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
    /// Credentials that were made with the token and ended with it; absent if there were none, or if you revoked your own token.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndedCredentialsView>,
}

/// A user whose access has changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ChangedAccessView {
    /// The user.
    #[serde(flatten)]
    pub user: UserView,
    /// Credentials that the user had made and that ended, too; absent if there were none.
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
    /// Credentials that ended because the user got access again; absent if there were none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndedCredentialsView>,
}
