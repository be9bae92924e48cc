//! Credentials (tokens, invitations, webhooks) that ended with the rights of their creator.

use super::{invitation, token, user, webhook};
use faceoff_api::views::credentials::EndedCredentialsView;
use faceoff_store::EndedCredentials;
use jiff::Timestamp;

/// The credentials that ended, and the accounts that stay although they were created or restored by such an invitation. `None` if there is
/// neither.
pub fn ended(ended: EndedCredentials, now: Timestamp) -> Option<EndedCredentialsView> {
    if ended == EndedCredentials::default() {
        return None;
    }
    let invitations = ended.invitations.into_iter();
    let webhooks = ended.webhooks.into_iter();
    Some(EndedCredentialsView {
        tokens: ended.tokens.into_iter().map(token::view).collect(),
        invitations: invitations
            .map(|invitation| invitation::view(invitation, now))
            .collect(),
        webhooks: webhooks
            .map(|webhook| webhook::view(webhook, now))
            .collect(),
        remaining_users: ended.remaining_users.into_iter().map(user::view).collect(),
        restored_users: ended.restored_users.into_iter().map(user::view).collect(),
    })
}
