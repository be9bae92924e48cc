//! Who makes a request, checked in the transaction of the change: a body takes time to arrive, and meanwhile the token may have been
//! revoked.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    tables::{
        tokens::{self, Creator},
        users,
    },
};
use faceoff_types::{TokenId, UserId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// The user and the token of a request. The default is the server itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct Requester {
    /// `None`: the operator, a team's API client or the server.
    pub user: Option<UserId>,
    /// The token or session, with the hash of its secret: another secret makes requests with the old one invalid.
    pub token: Option<(TokenId, [u8; 32])>,
}

impl Requester {
    /// The creator of what the requester makes.
    #[must_use]
    pub fn creator(&self) -> Creator {
        Creator {
            user: self.user,
            token: self.token.map(|(id, _)| id),
        }
    }
}

/// Is the token of the requester valid at `now`, with this secret, and has the user an account?
#[boxed_future]
pub(crate) async fn is_valid(
    connection: &mut SqliteConnection,
    requester: &Requester,
    now: Timestamp,
) -> Result<bool> {
    if let Some((id, hash)) = requester.token {
        let token = match tokens::find(connection, id).await {
            Err(StoreError::NotFound(_)) => return Ok(false),
            token => token?,
        };
        if !token.is_valid(now) || tokens::hash_of(connection, id).await? != hash {
            return Ok(false);
        }
    }
    match requester.user {
        Some(user) => Ok(users::find(connection, user).await?.left_at.is_none()),
        None => Ok(true),
    }
}

/// Returns the creator of what the requester makes. [`StoreError::TokenInvalid`] if the requester has lost the right to it.
#[boxed_future]
pub(crate) async fn check(
    connection: &mut SqliteConnection,
    requester: &Requester,
    now: Timestamp,
) -> Result<Creator> {
    if is_valid(connection, requester, now).await? {
        Ok(requester.creator())
    } else {
        Err(StoreError::TokenInvalid)
    }
}
