//! The table of tokens: the secrets by which API clients and browsers authenticate.

use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
};
use faceoff_types::{TeamId, TokenId, UserId};
use jiff::Timestamp;
use sqlx::SqliteConnection;
use std::cmp::Reverse;

/// The owner of a token, as whom its requests act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenOwner {
    /// The operator: any process that can read the data folder. It acts as an organiser.
    Operator,
    /// A team's API clients.
    Team(TeamId),
    /// A user, with their role.
    User(UserId),
}

impl TokenOwner {
    const fn kind(self) -> &'static str {
        match self {
            Self::Operator => "host",
            Self::Team(_) => "team",
            Self::User(_) => "person",
        }
    }

    const fn team(self) -> Option<TeamId> {
        match self {
            Self::Team(id) => Some(id),
            Self::Operator | Self::User(_) => None,
        }
    }

    const fn user(self) -> Option<UserId> {
        match self {
            Self::User(id) => Some(id),
            Self::Operator | Self::Team(_) => None,
        }
    }

    fn from_columns(team: Option<TeamId>, user: Option<UserId>) -> Self {
        match (team, user) {
            (Some(team), _) => Self::Team(team),
            (None, Some(user)) => Self::User(user),
            (None, None) => Self::Operator,
        }
    }
}

/// How a client sends the token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// In the header `Authorization`; stored as `key`.
    ApiToken,
    /// As a browser's cookie, after signing in.
    Session,
}

impl TokenKind {
    const fn name(self) -> &'static str {
        match self {
            Self::ApiToken => "key",
            Self::Session => "session",
        }
    }
}

/// Who made a credential (a token, an invitation or a webhook), or gave it its current secret. The credential is revoked when that
/// user's account is closed, and when the user gets a new password or gets access again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Creator {
    /// `None`: the operator, a visitor or the server.
    pub user: Option<UserId>,
    /// The token or session of the request.
    pub token: Option<TokenId>,
}

/// An API token or a browser's session. Only a hash of the secret is stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    /// Not secret: the token cannot be derived from it.
    pub id: TokenId,
    pub kind: TokenKind,
    pub owner: TokenOwner,
    /// A label, chosen by its owner.
    pub name: String,
    pub creator: Creator,
    pub created_at: Timestamp,
    /// `None`: it does not expire.
    pub expires_at: Option<Timestamp>,
    pub last_used_at: Option<Timestamp>,
    pub revoked_at: Option<Timestamp>,
}

impl Token {
    /// Is the token neither revoked nor expired at `now`?
    #[must_use]
    pub fn is_valid(&self, now: Timestamp) -> bool {
        self.revoked_at.is_none() && self.expires_at.is_none_or(|at| now < at)
    }
}

struct TokenRow {
    id: TokenId,
    is_key: bool,
    team_id: Option<TeamId>,
    person_id: Option<UserId>,
    name: String,
    made_by: Option<UserId>,
    made_with: Option<TokenId>,
    created_at: Instant,
    expires_at: Option<Instant>,
    last_used_at: Option<Instant>,
    revoked_at: Option<Instant>,
}

impl From<TokenRow> for Token {
    fn from(row: TokenRow) -> Self {
        Self {
            id: row.id,
            kind: if row.is_key {
                TokenKind::ApiToken
            } else {
                TokenKind::Session
            },
            owner: TokenOwner::from_columns(row.team_id, row.person_id),
            name: row.name,
            creator: Creator {
                user: row.made_by,
                token: row.made_with,
            },
            created_at: row.created_at.0,
            expires_at: row.expires_at.map(|at| at.0),
            last_used_at: row.last_used_at.map(|at| at.0),
            revoked_at: row.revoked_at.map(|at| at.0),
        }
    }
}

/// `SELECT` of whole tokens; the argument is the SQL after `FROM tokens`.
macro_rules! select_tokens {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            TokenRow,
            r#"SELECT id, kind = 'key' AS "is_key!: bool", team_id, person_id, name, made_by, made_with,
                      created_at, expires_at, last_used_at, revoked_at
               FROM tokens "# + $tail
            $(, $argument)*
        )
    };
}

/// The owners whose tokens and sessions a list contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenFilter {
    /// All owners: users, teams and the operator.
    Everyone,
    /// Those of a user.
    User(UserId),
    /// Those of a user, and those of the user's team.
    Member(UserId, TeamId),
}

impl TokenFilter {
    /// Is the token in the list?
    #[must_use]
    pub fn includes(self, token: &Token) -> bool {
        match (self, token.owner) {
            (Self::Everyone, _) => true,
            (Self::User(user) | Self::Member(user, _), TokenOwner::User(id)) => user == id,
            (Self::Member(_, team), TokenOwner::Team(id)) => team == id,
            _ => false,
        }
    }
}

/// At most `limit` API tokens and sessions, the newest first; only those that come after the token `after` in this order.
pub(crate) async fn list(
    connection: &mut SqliteConnection,
    of: TokenFilter,
    after: Option<&Token>,
    limit: u32,
) -> Result<Vec<Token>> {
    let created_at = Instant(after.map_or(Timestamp::MAX, |token| token.created_at));
    let id = after.map(|token| token.id);
    let rows = match of {
        TokenFilter::Everyone => {
            select_tokens!(
                "WHERE (created_at, id) < (?, ?) ORDER BY created_at DESC, id DESC LIMIT ?",
                created_at,
                id,
                limit
            )
            .fetch_all(connection)
            .await?
        }
        TokenFilter::User(user) | TokenFilter::Member(user, _) => {
            let mut rows = select_tokens!(
                "WHERE person_id = ? AND (created_at, id) < (?, ?) ORDER BY created_at DESC, id DESC LIMIT ?",
                user,
                created_at,
                id,
                limit
            )
            .fetch_all(&mut *connection)
            .await?;
            if let TokenFilter::Member(_, team) = of {
                let rows_of_team = select_tokens!(
                    "WHERE team_id = ? AND (created_at, id) < (?, ?) ORDER BY created_at DESC, id DESC LIMIT ?",
                    team,
                    created_at,
                    id,
                    limit
                );
                rows.extend(rows_of_team.fetch_all(connection).await?);
                rows.sort_by_key(|row| Reverse((row.created_at.0, row.id)));
                rows.truncate(limit as usize);
            }
            rows
        }
    };
    Ok(rows.into_iter().map(Token::from).collect())
}

/// The operator's tokens, valid or not.
pub(crate) async fn of_operator(connection: &mut SqliteConnection) -> Result<Vec<Token>> {
    let rows = select_tokens!("WHERE owner = 'host' ORDER BY created_at")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Token::from).collect())
}

/// The tokens and sessions that are valid at `now`, the newest first.
pub(crate) async fn valid(
    connection: &mut SqliteConnection,
    of: TokenFilter,
    now: Timestamp,
) -> Result<Vec<Token>> {
    let now = Instant(now);
    let mut rows = match of {
        TokenFilter::Everyone => {
            select_tokens!(
                "WHERE revoked_at IS NULL AND (expires_at IS NULL OR expires_at > ?)",
                now
            )
            .fetch_all(connection)
            .await?
        }
        TokenFilter::User(user) | TokenFilter::Member(user, _) => {
            let mut rows = select_tokens!(
                "WHERE owner = 'person' AND team_id IS NULL AND person_id = ? AND revoked_at IS NULL
                 AND (expires_at IS NULL OR expires_at > ?)",
                user,
                now
            )
            .fetch_all(&mut *connection)
            .await?;
            if let TokenFilter::Member(_, team) = of {
                let rows_of_team = select_tokens!(
                    "WHERE owner = 'team' AND team_id = ? AND revoked_at IS NULL AND (expires_at IS NULL OR expires_at > ?)",
                    team,
                    now
                );
                rows.extend(rows_of_team.fetch_all(connection).await?);
            }
            rows
        }
    };
    rows.sort_by_key(|row| Reverse((row.created_at.0, row.id)));
    Ok(rows.into_iter().map(Token::from).collect())
}

/// Deletes at most `limit` tokens and sessions that ended at `ended_until` or earlier. Credentials that were created with a
/// deleted token are attributed to the token that created it, so that they still end with that one. Tokens of the operator stay: a revoked
/// one in the file of a restored data folder must be recognised. Returns the number of tokens.
pub(crate) async fn delete_ended(
    connection: &mut SqliteConnection,
    ended_until: Timestamp,
    limit: u32,
) -> Result<usize> {
    let ended = sqlx::query!(
        r#"SELECT id AS "id!: TokenId" FROM tokens
           WHERE coalesce(revoked_at, expires_at) <= ? AND owner <> 'host' ORDER BY coalesce(revoked_at, expires_at) LIMIT ?"#,
        Instant(ended_until),
        limit
    )
    .fetch_all(&mut *connection)
    .await?;
    for row in &ended {
        // Read for each row: the one that it was made with may have just been deleted, too.
        let made_with = sqlx::query_scalar!(
            r#"SELECT made_with AS "made_with: TokenId" FROM tokens WHERE id = ?"#,
            row.id
        )
        .fetch_one(&mut *connection)
        .await?;
        sqlx::query!(
            "UPDATE tokens SET made_with = ? WHERE made_with = ?",
            made_with,
            row.id
        )
        .execute(&mut *connection)
        .await?;
        sqlx::query!(
            "UPDATE invitations SET made_with = ? WHERE made_with = ?",
            made_with,
            row.id
        )
        .execute(&mut *connection)
        .await?;
        sqlx::query!(
            "UPDATE webhooks SET made_with = ? WHERE made_with = ?",
            made_with,
            row.id
        )
        .execute(&mut *connection)
        .await?;
        sqlx::query!("DELETE FROM tokens WHERE id = ?", row.id)
            .execute(&mut *connection)
            .await?;
    }
    Ok(ended.len())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: TokenId) -> Result<Token> {
    select_tokens!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Token::from)
        .ok_or(StoreError::NotFound("token"))
}

/// The token with this hash, valid or not.
pub(crate) async fn by_hash(
    connection: &mut SqliteConnection,
    hash: [u8; 32],
) -> Result<Option<Token>> {
    let row = select_tokens!("WHERE hash = ?", Bytes32(hash))
        .fetch_optional(connection)
        .await?;
    Ok(row.map(Token::from))
}

/// The stored hash of a token.
pub(crate) async fn hash_of(connection: &mut SqliteConnection, id: TokenId) -> Result<[u8; 32]> {
    sqlx::query_scalar!("SELECT hash FROM tokens WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(|hash| hash.0)
        .ok_or(StoreError::NotFound("token"))
}

/// The tokens and sessions that this user has made, or that were made with this token, also those that are no longer valid.
pub(crate) async fn created_by(
    connection: &mut SqliteConnection,
    creator: Creator,
) -> Result<Vec<Token>> {
    let rows = select_tokens!(
        "WHERE made_by = ? OR made_with = ? ORDER BY created_at, id",
        creator.user,
        creator.token
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Token::from).collect())
}

/// Number of an owner's valid tokens and sessions at `now`.
pub(crate) async fn count_valid(
    connection: &mut SqliteConnection,
    owner: TokenOwner,
    now: Timestamp,
) -> Result<i64> {
    Ok(sqlx::query_scalar!(
        "SELECT COUNT(*) FROM tokens
         WHERE owner = ? AND team_id IS ? AND person_id IS ? AND revoked_at IS NULL
           AND (expires_at IS NULL OR expires_at > ?)",
        owner.kind(),
        owner.team(),
        owner.user(),
        Instant(now),
    )
    .fetch_one(connection)
    .await?)
}

/// Adds a token. [`StoreError::Conflict`] if its hash exists.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    token: &Token,
    hash: [u8; 32],
) -> Result<()> {
    let owner = token.owner;
    sqlx::query!(
        "INSERT INTO tokens (id, hash, kind, owner, team_id, person_id, name, made_by, made_with, created_at, expires_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        token.id,
        Bytes32(hash),
        token.kind.name(),
        owner.kind(),
        owner.team(),
        owner.user(),
        token.name,
        token.creator.user,
        token.creator.token,
        Instant(token.created_at),
        token.expires_at.map(Instant),
    )
    .execute(connection)
    .await
    .map_err(hash_error())?;
    Ok(())
}

/// Replaces a token's secret; the old one becomes invalid.
pub(crate) async fn set_hash(
    connection: &mut SqliteConnection,
    id: TokenId,
    hash: [u8; 32],
    creator: Creator,
) -> Result<()> {
    sqlx::query!(
        "UPDATE tokens SET hash = ?, made_by = ?, made_with = ?, last_used_at = NULL WHERE id = ?",
        Bytes32(hash),
        creator.user,
        creator.token,
        id
    )
    .execute(connection)
    .await
    .map_err(hash_error())?;
    Ok(())
}

pub(crate) async fn set_last_used(
    connection: &mut SqliteConnection,
    id: TokenId,
    used_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE tokens SET last_used_at = ? WHERE id = ?",
        Instant(used_at),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn revoke(
    connection: &mut SqliteConnection,
    id: TokenId,
    revoked_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE tokens SET revoked_at = ? WHERE id = ? AND revoked_at IS NULL",
        Instant(revoked_at),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Revokes all tokens and sessions of an owner, except the one with the id `kept`.
pub(crate) async fn revoke_others(
    connection: &mut SqliteConnection,
    owner: TokenOwner,
    kept: Option<TokenId>,
    revoked_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE tokens SET revoked_at = ?
         WHERE owner = ? AND team_id IS ? AND person_id IS ? AND revoked_at IS NULL AND id IS NOT ?",
        Instant(revoked_at),
        owner.kind(),
        owner.team(),
        owner.user(),
        kept,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The store's error for a failed write of a token's hash.
fn hash_error() -> impl FnOnce(sqlx::Error) -> StoreError {
    StoreError::if_duplicate("tokens.hash", || {
        StoreError::Conflict("there is such a token: draw a new one".into())
    })
}
