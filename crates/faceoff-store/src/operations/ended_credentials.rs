//! Revocation of the credentials that a user has created, when the user loses access or a token is revoked. A *credential* gives
//! access, or knowledge, without a password: a token, an invitation, a webhook.

use crate::{
    boxed_future,
    error::Result,
    event::{Event, Subject},
    operations::webhooks::disable,
    tables::{
        invitations::{self, Invitation, InvitationRole},
        tokens::{self, Creator, Token, TokenOwner},
        users::{self, User},
        webhooks::{self, Webhook},
    },
    write::Tx,
};
use faceoff_types::{TokenId, UserId};
use std::collections::{BTreeMap, HashSet};

/// Credentials that were revoked because a user lost access or a token was revoked, and accounts that came from them and stay.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EndedCredentials {
    pub tokens: Vec<Token>,
    pub invitations: Vec<Invitation>,
    pub webhooks: Vec<Webhook>,
    /// The active users who joined by invitations of the creator, or by those of such users: their accounts stay.
    pub remaining_users: Vec<User>,
    /// The active users who got access again by links of the creator: their new passwords and tokens stay.
    pub restored_users: Vec<User>,
}

/// Revokes the credentials that a user has created. `kept_token` is the token of the request, which stays valid.
pub(crate) async fn revoke_created_by(
    tx: &mut Tx,
    user: UserId,
    kept_token: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let creator = Creator {
        user: Some(user),
        token: None,
    };
    revoke_created(tx, creator, kept_token, reason).await
}

/// Revokes the credentials that were created with a token.
pub(crate) async fn revoke_created_with(
    tx: &mut Tx,
    token: TokenId,
    kept_token: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let creator = Creator {
        user: None,
        token: Some(token),
    };
    revoke_created(tx, creator, kept_token, reason).await
}

/// Revokes the credentials of this creator, and those that were created with its tokens, including tokens that had expired or were revoked
/// before.
#[boxed_future]
async fn revoke_created(
    tx: &mut Tx,
    creator: Creator,
    kept_token: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let now = tx.now;
    let mut ended = EndedCredentials::default();
    let mut creators = vec![creator];
    let mut visited = HashSet::new();
    while let Some(creator) = creators.pop() {
        if !visited.insert(creator) {
            continue;
        }
        for token in tokens::created_by(tx, creator).await? {
            if Some(token.id) == kept_token {
                continue;
            }
            creators.push(Creator {
                user: None,
                token: Some(token.id),
            });
            if token.is_valid(now) {
                revoke_token(tx, &token).await?;
                ended.tokens.push(tokens::find(tx, token.id).await?);
            }
        }
        for invitation in invitations::open_created_by(tx, creator, now).await? {
            let revoked = revoke_invitation(tx, invitation).await?;
            ended.invitations.push(revoked);
        }
        for webhook in webhooks::enabled_created_by(tx, creator).await? {
            let id = webhook.id;
            disable(tx, webhook, reason.to_owned()).await?;
            ended.webhooks.push(webhooks::find(tx, id).await?);
        }
    }
    let creators: Vec<Creator> = visited.into_iter().collect();
    ended.restored_users = restored_by(tx, &creators).await?;
    ended.remaining_users = joined_by(tx, creators).await?;
    Ok(ended)
}

/// The active users who got access again by links of these creators, other than the creators themselves, by name.
async fn restored_by(tx: &mut Tx, creators: &[Creator]) -> Result<Vec<User>> {
    let mut found = BTreeMap::new();
    for creator in creators {
        for user in users::restored_by(tx, *creator).await? {
            let is_creator = creators.iter().any(|creator| creator.user == Some(user.id));
            if user.left_at.is_none() && !is_creator {
                found.insert(user.name.to_string(), user);
            }
        }
    }
    Ok(found.into_values().collect())
}

/// The active users who joined by invitations of these creators, or of users who had joined so, by name.
async fn joined_by(tx: &mut Tx, mut creators: Vec<Creator>) -> Result<Vec<User>> {
    let mut visited: HashSet<UserId> = creators.iter().filter_map(|creator| creator.user).collect();
    let mut found = BTreeMap::new();
    while let Some(creator) = creators.pop() {
        for user in users::joined_by(tx, creator).await? {
            if !visited.insert(user.id) {
                continue;
            }
            creators.push(Creator {
                user: Some(user.id),
                token: None,
            });
            if user.left_at.is_none() {
                found.insert(user.name.to_string(), user);
            }
        }
    }
    Ok(found.into_values().collect())
}

/// The subject of events about a token of this owner.
pub(crate) const fn subject(owner: TokenOwner) -> Subject {
    match owner {
        TokenOwner::Operator => Subject::Season,
        TokenOwner::Team(id) => Subject::Team(id),
        TokenOwner::User(id) => Subject::User(id),
    }
}

/// Revokes a valid token.
pub(crate) async fn revoke_token(tx: &mut Tx, token: &Token) -> Result<()> {
    let now = tx.now;
    tokens::revoke(tx, token.id, now).await?;
    let event = Event::TokenRevoked {
        token: token.id,
        name: token.name.clone(),
    };
    tx.record(subject(token.owner), event);
    Ok(())
}

/// Revokes an open invitation.
pub(crate) async fn revoke_invitation(tx: &mut Tx, invitation: Invitation) -> Result<Invitation> {
    let now = tx.now;
    invitations::set_revoked(tx, invitation.id, now).await?;
    let subject = match invitation.role {
        InvitationRole::Member(team) => Subject::Team(team),
        InvitationRole::RestoreAccess(user) => Subject::User(user),
        InvitationRole::Organiser | InvitationRole::Founder => Subject::Season,
    };
    let event = Event::InvitationRevoked {
        invitation: invitation.id,
    };
    tx.record(subject, event);
    invitations::find(tx, invitation.id).await
}
