//! Keys and sessions: who holds which, and what it is worth.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        people::{self, Person},
        teams::{self, Team},
        tokens::{self, Token, TokenKind, TokenOwner},
    },
    write::Tx,
};
use faceoff_types::TokenId;
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;

/// Keys and sessions that one team or person may have at a time.
pub const MAX_TOKENS: i64 = 50;
/// How old the time of the last use may be before it is written again.
pub const LAST_USE: SignedDuration = SignedDuration::from_mins(1);
/// For how long a session is good.
pub const SESSION: SignedDuration = SignedDuration::from_hours(14 * 24);
/// For how long the list of a person's sessions shows one that is worth nothing any more.
const SESSION_SHOWN: SignedDuration = SignedDuration::from_hours(30 * 24);

/// Who calls with a token.
#[derive(Debug, Clone, PartialEq)]
pub struct Holder {
    pub token: Token,
    pub who: Who,
}

/// Whom a good token speaks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Who {
    /// Whoever may read the data folder.
    Host,
    Team(Team),
    Organiser(Person),
    /// A member of a team.
    Member(Person, Team),
}

/// A token to be made; the token itself is the caller's.
#[derive(Debug, Clone)]
pub struct NewToken {
    /// Of the token's text.
    pub hash: [u8; 32],
    pub kind: TokenKind,
    /// By whom it speaks.
    pub owner: TokenOwner,
    /// What its owner calls it.
    pub name: String,
    /// From then on it is worth nothing; none: it has no end.
    pub expires_at: Option<Timestamp>,
}

/// The name of the token that the host has in a file of the data folder.
const HOST_FILE: &str = "admin-token";

const fn subject(owner: TokenOwner) -> Subject {
    match owner {
        TokenOwner::Host => Subject::Season,
        TokenOwner::Team(id) => Subject::Team(id),
        TokenOwner::Person(id) => Subject::Person(id),
    }
}

/// Adds a token. [`StoreError::Conflict`] if its owner has as many as one may have.
pub(crate) async fn add(tx: &mut Tx, new: NewToken) -> Result<Token> {
    let now = tx.now;
    if tokens::count_good(tx, new.owner, now).await? >= MAX_TOKENS {
        return Err(StoreError::Conflict(format!(
            "there are {MAX_TOKENS} tokens already, and no more than that at a time: revoke one that is not needed \
             (DELETE /api/v1/tokens/ID)"
        )));
    }
    if new.expires_at.is_some_and(|at| at <= now) {
        return Err(StoreError::Conflict(format!(
            "expires_at: expected a time in the future, got {}",
            new.expires_at.unwrap_or(now)
        )));
    }
    let token = Token {
        id: TokenId::new(),
        kind: new.kind,
        owner: new.owner,
        name: new.name,
        created_at: now,
        expires_at: new.expires_at,
        last_used_at: None,
        revoked_at: None,
    };
    tokens::insert(tx, &token, new.hash).await?;
    let event = match token.kind {
        TokenKind::Key => Event::TokenCreated {
            token: token.id,
            name: token.name.clone(),
            expires_at: token.expires_at,
        },
        TokenKind::Session => Event::SignedIn,
    };
    tx.record(subject(token.owner), event);
    tokens::find(tx, token.id).await
}

/// Ends all that an owner has, but one.
pub(crate) async fn revoke_all(
    tx: &mut Tx,
    owner: TokenOwner,
    kept: Option<TokenId>,
) -> Result<()> {
    let now = tx.now;
    tokens::revoke_others(tx, owner, kept, now).await
}

async fn who(connection: &mut SqliteConnection, token: &Token) -> Result<Option<Who>> {
    Ok(match token.owner {
        TokenOwner::Host => Some(Who::Host),
        TokenOwner::Team(id) => Some(Who::Team(teams::find(connection, id).await?)),
        TokenOwner::Person(id) => {
            let person = people::find(connection, id).await?;
            match person.team {
                _ if person.left_at.is_some() => None,
                None => Some(Who::Organiser(person)),
                Some(team) => Some(Who::Member(person, teams::find(connection, team).await?)),
            }
        }
    })
}

/// A token that came, or what it signed, as of `now`.
async fn held(
    connection: &mut SqliteConnection,
    token: Token,
    now: Timestamp,
) -> Result<Result<Holder, Refusal>> {
    if let Some(at) = token.revoked_at {
        return Ok(Err(Refusal::Revoked(at)));
    }
    match token.expires_at {
        Some(at) if at <= now => return Ok(Err(Refusal::Expired(at))),
        _ => {}
    }
    let who = who(connection, &token).await?;
    Ok(who
        .map(|who| Holder { token, who })
        .ok_or(Refusal::Revoked(now)))
}

/// Why a token opens nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// There is none of this hash.
    Unknown,
    /// It came the other way: a key as a cookie, or a session in the header.
    WrongKind,
    /// It was revoked then, or its owner left.
    Revoked(Timestamp),
    /// It was good until then.
    Expired(Timestamp),
}

impl Store {
    /// Who holds the token of this hash, as of `now`: what is revoked or expired is refused from that moment on.
    #[boxed]
    pub async fn holder(
        &self,
        hash: [u8; 32],
        kind: TokenKind,
        now: Timestamp,
    ) -> Result<Result<Holder, Refusal>> {
        let mut connection = self.database.read.acquire().await?;
        let Some(token) = tokens::by_hash(&mut connection, hash).await? else {
            return Ok(Err(Refusal::Unknown));
        };
        if token.kind != kind {
            return Ok(Err(Refusal::WrongKind));
        }
        held(&mut connection, token, now).await
    }

    /// Who holds the token with this id, as of `now`, for whoever has something that was signed with its
    /// [hash](Store::token_hash).
    #[boxed]
    pub async fn holder_of(&self, id: TokenId, now: Timestamp) -> Result<Result<Holder, Refusal>> {
        let mut connection = self.database.read.acquire().await?;
        let token = tokens::find(&mut connection, id).await?;
        held(&mut connection, token, now).await
    }

    /// The hash of a token's text, which another secret changes. It is a key to sign with: nobody but the server and
    /// whoever has the token knows it.
    #[boxed]
    pub async fn token_hash(&self, id: TokenId) -> Result<[u8; 32]> {
        tokens::hash_of(&mut *self.database.read.acquire().await?, id).await
    }

    /// Notes that a token was used. Often enough is once in [`LAST_USE`].
    #[boxed]
    pub async fn token_used(&self, token: &Token, now: Timestamp) -> Result<()> {
        self.keep(Actor::Server, now, async |tx| {
            tokens::set_last_used(tx, token.id, now).await
        })
        .await
    }

    /// Makes a token. [`StoreError::Conflict`] if its owner has as many as one may have, or it would be worth
    /// nothing.
    #[boxed]
    pub async fn create_token(&self, actor: Actor, new: NewToken, now: Timestamp) -> Result<Token> {
        self.write(actor, now, async |tx| {
            if let Ok(long_ago) = now.checked_sub(SESSION_SHOWN) {
                tokens::forget(tx, long_ago).await?;
            }
            add(tx, new).await
        })
        .await
    }

    /// Gives a token another secret; from now on the old one is worth nothing. [`StoreError::Conflict`] if the token
    /// is not a key, is worth nothing, or is the one of the host's file, which would still have the old secret.
    #[boxed]
    pub async fn rotate_token(
        &self,
        actor: Actor,
        id: TokenId,
        hash: [u8; 32],
        now: Timestamp,
    ) -> Result<Token> {
        self.write(actor, now, async |tx| {
            let token = tokens::find(tx, id).await?;
            if token.kind == TokenKind::Session {
                return Err(StoreError::Conflict(
                    "a session has no secret that anybody could use: end it, or sign in again"
                        .into(),
                ));
            }
            if token.owner == TokenOwner::Host && token.name == HOST_FILE {
                return Err(StoreError::Conflict(
                    "the host's token stands in the server's data folder (admin-token), which would keep the old one: \
                     revoke it, and the next start of the server leaves another there"
                        .into(),
                ));
            }
            if !token.is_good(now) {
                return Err(StoreError::Conflict(
                    "the token is revoked or has expired, and stays so: make another one".into(),
                ));
            }
            tokens::set_hash(tx, id, hash).await?;
            let name = token.name;
            tx.record(
                subject(token.owner),
                Event::TokenRotated { token: id, name },
            );
            tokens::find(tx, id).await
        })
        .await
    }

    /// Ends a token: from now on it is worth nothing. One that is worth nothing stays as it is.
    #[boxed]
    pub async fn revoke_token(&self, actor: Actor, id: TokenId, now: Timestamp) -> Result<Token> {
        self.write(actor, now, async |tx| {
            let token = tokens::find(tx, id).await?;
            if token.revoked_at.is_none() {
                tokens::revoke(tx, id, now).await?;
                let name = token.name;
                tx.record(
                    subject(token.owner),
                    Event::TokenRevoked { token: id, name },
                );
            }
            tokens::find(tx, id).await
        })
        .await
    }

    /// Lets the token of this hash be the host's, and none that was the host's file's before. False if it is revoked:
    /// the host needs another one.
    #[boxed]
    pub async fn set_host_token(&self, hash: [u8; 32], now: Timestamp) -> Result<bool> {
        self.keep(Actor::Server, now, async |tx| {
            let known = tokens::by_hash(tx, hash).await?;
            if let Some(known) = known {
                return Ok(known.owner == TokenOwner::Host && known.is_good(now));
            }
            let before = tokens::all(tx).await?.into_iter().filter(|token| {
                token.owner == TokenOwner::Host
                    && token.name == HOST_FILE
                    && token.revoked_at.is_none()
            });
            for token in before {
                tokens::revoke(tx, token.id, now).await?;
                let (token, name) = (token.id, token.name);
                tx.record(Subject::Season, Event::TokenRevoked { token, name });
            }
            let new = NewToken {
                hash,
                kind: TokenKind::Key,
                owner: TokenOwner::Host,
                name: HOST_FILE.to_owned(),
                expires_at: None,
            };
            add(tx, new).await?;
            Ok(true)
        })
        .await
    }

    /// All keys and sessions, the newest first.
    #[boxed]
    pub async fn tokens(&self) -> Result<Vec<Token>> {
        tokens::all(&mut *self.database.read.acquire().await?).await
    }

    /// The token with this id.
    #[boxed]
    pub async fn token(&self, id: TokenId) -> Result<Token> {
        tokens::find(&mut *self.database.read.acquire().await?, id).await
    }
}
