//! The end of credentials with the rights of the user who made them. A *credential* is what gives access, or knowledge, without a
//! password: a token, an invitation, a webhook.

use crate::{
    boxed,
    error::Result,
    event::{Event, Subject},
    operations::webhooks::disable,
    tables::{
        invitations::{self, Invitation, InvitationRole},
        tokens::{self, Maker, Token, TokenOwner},
        users::{self, User},
        webhooks::{self, Webhook},
    },
    write::Tx,
};
use faceoff_types::{TokenId, UserId};
use std::collections::{BTreeMap, HashSet};

/// What ended with a user's rights or a token, and what did not.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EndedCredentials {
    pub tokens: Vec<Token>,
    pub invitations: Vec<Invitation>,
    pub webhooks: Vec<Webhook>,
    /// The users who joined by the invitations, or by those of such users: their accounts stay.
    pub remaining_users: Vec<User>,
    /// The users who got access again by the links: their new passwords and tokens stay.
    pub restored_users: Vec<User>,
}

/// Ends all that a user has made. `kept` is the token of the request, which stays valid.
pub(crate) async fn end_made_by(
    tx: &mut Tx,
    user: UserId,
    kept: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let maker = Maker {
        user: Some(user),
        token: None,
    };
    end_made(tx, maker, kept, reason).await
}

/// Ends all that was made with a token.
pub(crate) async fn end_made_with(
    tx: &mut Tx,
    token: TokenId,
    kept: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let maker = Maker {
        user: None,
        token: Some(token),
    };
    end_made(tx, maker, kept, reason).await
}

/// Ends what this maker has made, and what was made with the tokens among it, also with those that had ended before.
#[boxed]
async fn end_made(
    tx: &mut Tx,
    maker: Maker,
    kept: Option<TokenId>,
    reason: &str,
) -> Result<EndedCredentials> {
    let now = tx.now;
    let mut ended = EndedCredentials::default();
    let mut makers = vec![maker];
    let mut visited = HashSet::new();
    while let Some(maker) = makers.pop() {
        if !visited.insert(maker) {
            continue;
        }
        for token in tokens::made(tx, maker).await? {
            if Some(token.id) == kept {
                continue;
            }
            makers.push(Maker {
                user: None,
                token: Some(token.id),
            });
            if token.is_valid(now) {
                revoke_token(tx, &token).await?;
                ended.tokens.push(tokens::find(tx, token.id).await?);
            }
        }
        for invitation in invitations::open_made(tx, maker, now).await? {
            let revoked = revoke_invitation(tx, invitation).await?;
            ended.invitations.push(revoked);
        }
        for webhook in webhooks::enabled_made(tx, maker).await? {
            let id = webhook.id;
            disable(tx, webhook, reason.to_owned()).await?;
            ended.webhooks.push(webhooks::find(tx, id).await?);
        }
    }
    let makers: Vec<Maker> = visited.into_iter().collect();
    ended.restored_users = restored_by(tx, &makers).await?;
    ended.remaining_users = joined_by(tx, makers).await?;
    Ok(ended)
}

/// The active users who got access again by links of these makers, other than the makers themselves, by name.
async fn restored_by(tx: &mut Tx, makers: &[Maker]) -> Result<Vec<User>> {
    let mut found = BTreeMap::new();
    for maker in makers {
        for user in users::invited(tx, *maker, true).await? {
            let is_maker = makers.iter().any(|maker| maker.user == Some(user.id));
            if user.left_at.is_none() && !is_maker {
                found.insert(user.name.to_string(), user);
            }
        }
    }
    Ok(found.into_values().collect())
}

/// The active users who joined by invitations of these makers, or of users who had joined so, by name.
async fn joined_by(tx: &mut Tx, mut makers: Vec<Maker>) -> Result<Vec<User>> {
    let mut visited: HashSet<UserId> = makers.iter().filter_map(|maker| maker.user).collect();
    let mut found = BTreeMap::new();
    while let Some(maker) = makers.pop() {
        for user in users::invited(tx, maker, false).await? {
            if !visited.insert(user.id) {
                continue;
            }
            makers.push(Maker {
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
        TokenOwner::Host => Subject::Season,
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
        InvitationRole::PasswordReset(user) => Subject::User(user),
        InvitationRole::Organiser | InvitationRole::Founder => Subject::Season,
    };
    let event = Event::InvitationRevoked {
        invitation: invitation.id,
    };
    tx.record(subject, event);
    invitations::find(tx, invitation.id).await
}
