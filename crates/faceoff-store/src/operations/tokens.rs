//! Tokens of API clients and sessions of browsers: creation, verification, rotation (replacement of the secret) and
//! revocation. The operator's token is in a file of the data folder; the *operator* runs the server and can read that file.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event},
    operations::{
        ended_credentials::{EndedCredentials, revoke_created_with, revoke_token, subject},
        requester::{self, Requester},
    },
    store::Store,
    tables::{
        teams::{self, Team},
        tokens::{self, Token, TokenFilter, TokenKind, TokenOwner},
        users::{self, User},
    },
    write::Tx,
};
use faceoff_types::{TokenId, UserId};
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;

/// Number of valid tokens and sessions that one team or user may have at a time.
pub const MAX_TOKENS: i64 = 50;
/// Minimum interval between two updates of a token's last use.
pub const LAST_USE_INTERVAL: SignedDuration = SignedDuration::from_mins(1);
/// Time from a session's start to its expiry.
pub const SESSION_LIFETIME: SignedDuration = SignedDuration::from_hours(14 * 24);

/// A valid token with its principal.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifiedToken {
    pub token: Token,
    pub principal: Principal,
}

/// The user, team or operator that a token authenticates.
#[derive(Debug, Clone, PartialEq)]
pub enum Principal {
    /// The operator with access to the data folder.
    Operator,
    Team(Team),
    Organiser(User),
    Member(User, Team),
}

/// A token to be created. The caller makes its text; only the hash is stored.
#[derive(Debug, Clone)]
pub struct NewToken {
    /// Hash of the token's text.
    pub hash: [u8; 32],
    pub kind: TokenKind,
    pub owner: TokenOwner,
    /// Label chosen by the owner.
    pub name: String,
    pub requester: Requester,
    /// `None`: it does not expire.
    pub expires_at: Option<Timestamp>,
}

/// What the revocation of a token covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RevocationExtent {
    /// The token only; the credentials that were created with it stay valid.
    TokenOnly,
    /// Also the credentials that were created with it, except the token of the request.
    WithCreatedExcept(Option<TokenId>),
}

/// A token that was revoked, and what ended with it.
#[derive(Debug, Clone, PartialEq)]
pub struct RevokedToken {
    pub token: Token,
    pub ended: EndedCredentials,
}

/// Name of the operator's token that is kept in a file of the data folder.
const OPERATOR_TOKEN_NAME: &str = "admin-token";

/// Adds a token. [`StoreError::Conflict`] if its owner has [`MAX_TOKENS`].
pub(crate) async fn add_token(tx: &mut Tx, new: NewToken) -> Result<Token> {
    let now = tx.now;
    let creator = requester::check(tx, &new.requester, now).await?;
    if tokens::count_valid(tx, new.owner, now).await? >= MAX_TOKENS {
        return StoreError::conflict(format!(
            "there are {MAX_TOKENS} tokens already, which is the limit: revoke one that is not needed \
             (DELETE /api/v1/tokens/ID)"
        ));
    }
    if new.expires_at.is_some_and(|at| at <= now) {
        return StoreError::conflict(format!(
            "expires_at: expected a time in the future, got {}",
            new.expires_at.unwrap_or(now)
        ));
    }
    let token = Token {
        id: TokenId::new(),
        kind: new.kind,
        owner: new.owner,
        name: new.name,
        creator,
        created_at: now,
        expires_at: new.expires_at,
        last_used_at: None,
        revoked_at: None,
    };
    tokens::insert(tx, &token, new.hash).await?;
    let event = match token.kind {
        TokenKind::ApiToken => Event::TokenCreated {
            token: token.id,
            name: token.name.clone(),
            expires_at: token.expires_at,
        },
        TokenKind::Session => Event::SignedIn,
    };
    tx.record(subject(token.owner), event);
    tokens::find(tx, token.id).await
}

/// Revokes all tokens and sessions of an owner, except `kept`.
pub(crate) async fn revoke_all(
    tx: &mut Tx,
    owner: TokenOwner,
    kept: Option<TokenId>,
) -> Result<()> {
    let now = tx.now;
    tokens::revoke_others(tx, owner, kept, now).await
}

async fn principal_of(
    connection: &mut SqliteConnection,
    token: &Token,
) -> Result<Option<Principal>> {
    Ok(match token.owner {
        TokenOwner::Operator => Some(Principal::Operator),
        TokenOwner::Team(id) => Some(Principal::Team(teams::find(connection, id).await?)),
        TokenOwner::User(id) => {
            let user = users::find(connection, id).await?;
            match user.team {
                _ if user.left_at.is_some() => None,
                None => Some(Principal::Organiser(user)),
                Some(team) => Some(Principal::Member(
                    user,
                    teams::find(connection, team).await?,
                )),
            }
        }
    })
}

/// Checks at `now` that a presented token is valid, and finds its principal.
async fn check_token(
    connection: &mut SqliteConnection,
    token: Token,
    now: Timestamp,
) -> Result<Result<VerifiedToken, TokenRejection>> {
    if let Some(at) = token.revoked_at {
        return Ok(Err(TokenRejection::Revoked(at)));
    }
    match token.expires_at {
        Some(at) if at <= now => return Ok(Err(TokenRejection::Expired(at))),
        _ => {}
    }
    let principal = principal_of(connection, &token).await?;
    Ok(principal
        .map(|principal| VerifiedToken { token, principal })
        .ok_or(TokenRejection::Revoked(now)))
}

/// Why a token is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenRejection {
    /// There is no token with this hash.
    Unknown,
    /// A token was sent as a cookie, or a session in the header.
    WrongKind,
    /// The token is revoked since this time, or its owner has left: then this is the time of the check.
    Revoked(Timestamp),
    /// The token has expired at this time.
    Expired(Timestamp),
}

impl Store {
    /// Verifies the token with this hash at `now`: revoked and expired tokens are rejected at once.
    #[boxed_future]
    pub async fn verify_token(
        &self,
        hash: [u8; 32],
        kind: TokenKind,
        now: Timestamp,
    ) -> Result<Result<VerifiedToken, TokenRejection>> {
        let mut connection = self.database.read.acquire().await?;
        let Some(token) = tokens::by_hash(&mut connection, hash).await? else {
            return Ok(Err(TokenRejection::Unknown));
        };
        if token.kind != kind {
            return Ok(Err(TokenRejection::WrongKind));
        }
        check_token(&mut connection, token, now).await
    }

    /// Verifies the token with this id at `now`, for a request signed with the token's [hash](Store::token_hash).
    #[boxed_future]
    pub async fn verify_token_id(
        &self,
        id: TokenId,
        now: Timestamp,
    ) -> Result<Result<VerifiedToken, TokenRejection>> {
        let mut connection = self.database.read.acquire().await?;
        let token = tokens::find(&mut connection, id).await?;
        check_token(&mut connection, token, now).await
    }

    /// Hash of a token's text; it changes on rotation. Serves as a signing key, since only the server and the token's
    /// owner know it.
    #[boxed_future]
    pub async fn token_hash(&self, id: TokenId) -> Result<[u8; 32]> {
        tokens::hash_of(&mut *self.database.read.acquire().await?, id).await
    }

    /// Records that a token was used. Callers need not call it more often than every [`LAST_USE_INTERVAL`].
    #[boxed_future]
    pub async fn record_token_use(&self, token: &Token, now: Timestamp) -> Result<()> {
        self.write_even_archived(Actor::Server, now, async |tx| {
            tokens::set_last_used(tx, token.id, now).await
        })
        .await
    }

    /// Creates a token. [`StoreError::Conflict`] if its owner has [`MAX_TOKENS`], or it would be expired.
    #[boxed_future]
    pub async fn create_token(&self, actor: Actor, new: NewToken, now: Timestamp) -> Result<Token> {
        self.write(actor, now, async |tx| add_token(tx, new).await)
            .await
    }

    /// Creates the session of a user whose password has been verified against `verified_hash`, its stored form. False if the user has
    /// another password by now, or has left.
    #[boxed_future]
    pub async fn sign_in(
        &self,
        id: UserId,
        verified_hash: &str,
        new: NewToken,
        now: Timestamp,
    ) -> Result<bool> {
        self.write(Actor::User(id), now, async |tx| {
            if users::password_hash_of(tx, id).await?.as_deref() != Some(verified_hash) {
                return Ok(false);
            }
            add_token(tx, new).await?;
            Ok(true)
        })
        .await
    }

    /// Is the requester's token still valid, and has its user an account?
    #[boxed_future]
    pub async fn is_valid(&self, requester: &Requester, now: Timestamp) -> Result<bool> {
        requester::is_valid(&mut *self.database.read.acquire().await?, requester, now).await
    }

    /// Replaces the secret of a token; the old secret is invalid from now on, and its expiry remains. The requester becomes its
    /// creator, unless the requester created it or is authenticated by this very token. [`StoreError::Conflict`] if the token is a
    /// session, is expired or revoked, or is the operator's, whose file would still have the old secret.
    #[boxed_future]
    pub async fn rotate_token(
        &self,
        actor: Actor,
        id: TokenId,
        hash: [u8; 32],
        requester: Requester,
        now: Timestamp,
    ) -> Result<Token> {
        self.write(actor, now, async |tx| {
            let requester_as_creator = requester::check(tx, &requester, now).await?;
            let token = tokens::find(tx, id).await?;
            // Otherwise a token that was created with a stolen token could rotate itself, and would then survive the revocation of the
            // stolen one.
            let is_same = requester_as_creator.token == Some(id)
                || requester_as_creator.user == token.creator.user;
            let creator = if is_same { token.creator } else { requester_as_creator };
            if token.kind == TokenKind::Session {
                return StoreError::conflict(
                    "a session has no secret that could be rotated: end it, or sign in again",
                );
            }
            if token.owner == TokenOwner::Operator && token.name == OPERATOR_TOKEN_NAME {
                return StoreError::conflict(
                    "the operator's token is a file in the server's data folder (admin-token), which would keep the old one: \
                     revoke it, and the server writes a new one at its next start",
                );
            }
            if !token.is_valid(now) {
                return StoreError::conflict(
                    "the token is revoked or has expired, which is final: create another one",
                );
            }
            tokens::set_hash(tx, id, hash, creator).await?;
            let name = token.name;
            tx.record(
                subject(token.owner),
                Event::TokenRotated { token: id, name },
            );
            tokens::find(tx, id).await
        })
        .await
    }

    /// Revokes a token, effective at once. A revoked token is left unchanged.
    #[boxed_future]
    pub async fn revoke_token(
        &self,
        actor: Actor,
        id: TokenId,
        extent: RevocationExtent,
        now: Timestamp,
    ) -> Result<RevokedToken> {
        self.write(actor, now, async |tx| {
            let token = tokens::find(tx, id).await?;
            if token.revoked_at.is_none() {
                revoke_token(tx, &token).await?;
            }
            let ended = match extent {
                RevocationExtent::TokenOnly => EndedCredentials::default(),
                RevocationExtent::WithCreatedExcept(kept) => {
                    let reason = "the token with which it was made was revoked";
                    revoke_created_with(tx, id, kept, reason).await?
                }
            };
            Ok(RevokedToken {
                token: tokens::find(tx, id).await?,
                ended,
            })
        })
        .await
    }

    /// Makes the token with this hash the operator's token, and revokes the previous one. False if the token is revoked or
    /// expired, so that the operator needs a new one.
    #[boxed_future]
    pub async fn set_operator_token(&self, hash: [u8; 32], now: Timestamp) -> Result<bool> {
        self.write_even_archived(Actor::Server, now, async |tx| {
            if let Some(existing) = tokens::by_hash(tx, hash).await? {
                return Ok(existing.owner == TokenOwner::Operator && existing.is_valid(now));
            }
            let previous = tokens::of_operator(tx).await?.into_iter().filter(|token| {
                token.owner == TokenOwner::Operator
                    && token.name == OPERATOR_TOKEN_NAME
                    && token.revoked_at.is_none()
            });
            for token in previous {
                revoke_token(tx, &token).await?;
            }
            let new = NewToken {
                hash,
                kind: TokenKind::ApiToken,
                owner: TokenOwner::Operator,
                name: OPERATOR_TOKEN_NAME.to_owned(),
                requester: Requester::default(),
                expires_at: None,
            };
            add_token(tx, new).await?;
            Ok(true)
        })
        .await
    }

    /// The tokens and sessions that are valid at `now`, the newest first. Their number is bounded: an owner has at most
    /// [`MAX_TOKENS`].
    #[boxed_future]
    pub async fn valid_tokens(&self, of: TokenFilter, now: Timestamp) -> Result<Vec<Token>> {
        tokens::valid(&mut *self.database.read.acquire().await?, of, now).await
    }

    /// At most `limit` tokens and sessions, the newest first. With `after`, those that come after this token; `None` if it is not
    /// in the list.
    #[boxed_future]
    pub async fn tokens_after(
        &self,
        of: TokenFilter,
        after: Option<TokenId>,
        limit: u32,
    ) -> Result<Option<Vec<Token>>> {
        let mut connection = self.database.read.acquire().await?;
        let after = match after {
            None => None,
            Some(id) => match tokens::find(&mut connection, id).await {
                Ok(token) if of.includes(&token) => Some(token),
                Ok(_) | Err(StoreError::NotFound(_)) => return Ok(None),
                Err(error) => return Err(error),
            },
        };
        let listed = tokens::list(&mut connection, of, after.as_ref(), limit).await?;
        Ok(Some(listed))
    }

    #[boxed_future]
    pub async fn token(&self, id: TokenId) -> Result<Token> {
        tokens::find(&mut *self.database.read.acquire().await?, id).await
    }
}
