//! User accounts, and the terms that users accept.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        ended_credentials::{EndedCredentials, revoke_created_by},
        tokens::revoke_all,
    },
    store::Store,
    tables::{
        terms::{self, Terms},
        tokens::{self, TokenOwner},
        users::{self, User},
    },
};
use faceoff_types::{TeamId, TokenId, UserId, UserName};
use jiff::Timestamp;

impl Store {
    /// All users who have ever joined, by name.
    #[boxed_future]
    pub async fn users(&self) -> Result<Vec<User>> {
        users::all(&mut *self.database.read.acquire().await?).await
    }

    /// Current and former members of a team, by name.
    #[boxed_future]
    pub async fn members_of(&self, team: TeamId) -> Result<Vec<User>> {
        users::of_team(&mut *self.database.read.acquire().await?, team).await
    }

    #[boxed_future]
    pub async fn user(&self, id: UserId) -> Result<User> {
        users::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// Id and password hash (PHC string) of the user with this name, if there is one with a password.
    #[boxed_future]
    pub async fn password_hash_of(&self, name: &str) -> Result<Option<(UserId, String)>> {
        users::find_with_password(&mut *self.database.read.acquire().await?, name).await
    }

    /// Sets a user's password, given as a PHC string (a hash with its parameters). All tokens and sessions of the user are revoked
    /// except `used_token`, which authenticated this request. If the user had a password before, the credentials (tokens,
    /// invitations, webhooks) that the user has created are revoked, too.
    #[boxed_future]
    pub async fn set_password(
        &self,
        actor: Actor,
        id: UserId,
        password_hash: &str,
        used_token: TokenId,
        now: Timestamp,
    ) -> Result<(User, EndedCredentials)> {
        self.write(actor, now, async |tx| {
            let had_password = users::password_hash_of(tx, id).await?.is_some();
            users::set_password(tx, id, password_hash).await?;
            revoke_all(tx, TokenOwner::User(id), Some(used_token)).await?;
            tx.record(Subject::User(id), Event::PasswordSet);
            let reason = "the user who made it has set a new password";
            let mut ended = if had_password {
                revoke_created_by(tx, id, Some(used_token), reason).await?
            } else {
                EndedCredentials::default()
            };
            // After a change of one's own password the accounts of invited users are not reported.
            ended.remaining_users.clear();
            ended.restored_users.clear();
            Ok((users::find(tx, id).await?, ended))
        })
        .await
    }

    /// Renames a user. Tokens and sessions stay valid; the old name no longer signs in.
    /// [`StoreError::UserNameTaken`] if another user has the name, [`StoreError::Conflict`] if the user has left.
    #[boxed_future]
    pub async fn rename_user(
        &self,
        actor: Actor,
        id: UserId,
        name: UserName,
        now: Timestamp,
    ) -> Result<User> {
        self.write(actor, now, async |tx| {
            let user = users::find(tx, id).await?;
            if user.left_at.is_some() {
                return StoreError::conflict(format!("{} has left", user.name));
            }
            if name != user.name {
                users::set_name(tx, id, &name).await?;
                let event = Event::UserRenamed {
                    from: user.name,
                    to: name,
                };
                tx.record(Subject::User(id), event);
            }
            users::find(tx, id).await
        })
        .await
    }

    /// Removes a user: all tokens and sessions are revoked at once, and so are the credentials (tokens, invitations, webhooks) that
    /// the user has created. The name stays in the log.
    /// [`StoreError::Conflict`] if the user has left, or if no one could organise the season afterwards: there is no other
    /// organiser and no valid token of the operator.
    #[boxed_future]
    pub async fn remove_user(
        &self,
        actor: Actor,
        id: UserId,
        now: Timestamp,
    ) -> Result<(User, EndedCredentials)> {
        self.write(actor, now, async |tx| {
            let user = users::find(tx, id).await?;
            if user.left_at.is_some() {
                return StoreError::conflict(format!("{} has left", user.name));
            }
            let is_last = user.team.is_none() && users::count_organisers(tx).await? == 1;
            users::set_left(tx, id, now).await?;
            revoke_all(tx, TokenOwner::User(id), None).await?;
            let reason = "the account of the user who made it is closed";
            let ended = revoke_created_by(tx, id, None, reason).await?;
            // Checked last: a token of the operator may have ended, too.
            if is_last && tokens::count_valid(tx, TokenOwner::Operator, now).await? == 0 {
                return StoreError::conflict(format!(
                    "{} is the last who can organise: invite another organiser first",
                    user.name
                ));
            }
            let name = user.name;
            tx.record(Subject::User(id), Event::UserLeft { name });
            Ok((users::find(tx, id).await?, ended))
        })
        .await
    }

    /// All versions of the terms, the newest first.
    #[boxed_future]
    pub async fn terms(&self) -> Result<Vec<Terms>> {
        terms::all(&mut *self.database.read.acquire().await?).await
    }

    /// Sets new terms. Teams cannot upload or choose submissions until one of their members has accepted them.
    /// [`StoreError::Conflict`] if the text is unchanged.
    #[boxed_future]
    pub async fn publish_terms(&self, actor: Actor, text: &str, now: Timestamp) -> Result<Terms> {
        self.write(actor, now, async |tx| {
            let newest = terms::all(tx).await?.into_iter().next();
            if newest.as_ref().is_some_and(|newest| newest.text == text) {
                return StoreError::conflict(
                    "the terms are the same as the current ones; nothing was changed",
                );
            }
            let new = Terms {
                version: newest.map_or(0, |newest| newest.version) + 1,
                since: now,
                text: text.to_owned(),
            };
            terms::insert(tx, &new).await?;
            let version = new.version;
            tx.record(Subject::Season, Event::TermsPublished { version });
            Ok(new)
        })
        .await
    }

    /// Records that a user accepts the terms. [`StoreError::Conflict`] unless `version` is the newest.
    #[boxed_future]
    pub async fn accept_terms(
        &self,
        actor: Actor,
        id: UserId,
        version: u32,
        now: Timestamp,
    ) -> Result<User> {
        self.write(actor, now, async |tx| {
            match terms::newest(tx).await? {
                Some(newest) if newest == version => {}
                Some(newest) => {
                    return StoreError::conflict(format!(
                        "version: expected {newest}, the newest of the terms, got {version}"
                    ));
                }
                None => return StoreError::conflict("this season has no terms"),
            }
            let user = users::find(tx, id).await?;
            if user.accepted_terms != Some(version) {
                users::set_accepted_terms(tx, id, version).await?;
                tx.record(Subject::User(id), Event::TermsAccepted { version });
            }
            users::find(tx, id).await
        })
        .await
    }
}
