use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
};
use faceoff_types::{PersonId, TeamId, TokenId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// By whom a token speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenOwner {
    /// Whoever may read the data folder; it acts as an organiser.
    Host,
    /// A team's programs.
    Team(TeamId),
    /// A person, with the role that they have.
    Person(PersonId),
}

impl TokenOwner {
    const fn kind(self) -> &'static str {
        match self {
            Self::Host => "host",
            Self::Team(_) => "team",
            Self::Person(_) => "person",
        }
    }

    const fn team(self) -> Option<Text<TeamId>> {
        match self {
            Self::Team(id) => Some(Text(id)),
            Self::Host | Self::Person(_) => None,
        }
    }

    const fn person(self) -> Option<Text<PersonId>> {
        match self {
            Self::Person(id) => Some(Text(id)),
            Self::Host | Self::Team(_) => None,
        }
    }

    fn of(team: Option<Text<TeamId>>, person: Option<Text<PersonId>>) -> Self {
        match (team, person) {
            (Some(team), _) => Self::Team(team.0),
            (None, Some(person)) => Self::Person(person.0),
            (None, None) => Self::Host,
        }
    }
}

/// How a token comes to the server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// In the header `Authorization`.
    Key,
    /// As a browser's cookie, after signing in.
    Session,
}

impl TokenKind {
    const fn name(self) -> &'static str {
        match self {
            Self::Key => "key",
            Self::Session => "session",
        }
    }
}

/// A key to the API. The token itself is never stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    /// Names it; tells nothing of the token.
    pub id: TokenId,
    pub kind: TokenKind,
    /// By whom it speaks.
    pub owner: TokenOwner,
    /// What its owner calls it.
    pub name: String,
    /// When it was made.
    pub created_at: Timestamp,
    /// From then on it is worth nothing; none: it has no end.
    pub expires_at: Option<Timestamp>,
    pub last_used_at: Option<Timestamp>,
    /// Since when it is worth nothing.
    pub revoked_at: Option<Timestamp>,
}

impl Token {
    /// Is it worth anything at `now`?
    #[must_use]
    pub fn is_good(&self, now: Timestamp) -> bool {
        self.revoked_at.is_none() && self.expires_at.is_none_or(|at| now < at)
    }
}

struct Row {
    id: Text<TokenId>,
    is_key: bool,
    team_id: Option<Text<TeamId>>,
    person_id: Option<Text<PersonId>>,
    name: String,
    created_at: Instant,
    expires_at: Option<Instant>,
    last_used_at: Option<Instant>,
    revoked_at: Option<Instant>,
}

impl From<Row> for Token {
    fn from(row: Row) -> Self {
        Self {
            id: row.id.0,
            kind: if row.is_key {
                TokenKind::Key
            } else {
                TokenKind::Session
            },
            owner: TokenOwner::of(row.team_id, row.person_id),
            name: row.name,
            created_at: row.created_at.0,
            expires_at: row.expires_at.map(|at| at.0),
            last_used_at: row.last_used_at.map(|at| at.0),
            revoked_at: row.revoked_at.map(|at| at.0),
        }
    }
}

/// `SELECT` of whole tokens; the argument is what follows `FROM tokens`.
macro_rules! select_tokens {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            Row,
            r#"SELECT id AS "id: Text<TokenId>", kind = 'key' AS "is_key!: bool",
                      team_id AS "team_id: Text<TeamId>", person_id AS "person_id: Text<PersonId>", name,
                      created_at AS "created_at: Instant", expires_at AS "expires_at: Instant",
                      last_used_at AS "last_used_at: Instant", revoked_at AS "revoked_at: Instant"
               FROM tokens "# + $tail
            $(, $argument)*
        )
    };
}

/// All keys and sessions, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Token>> {
    let rows = select_tokens!("ORDER BY created_at DESC, id DESC")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Token::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: TokenId) -> Result<Token> {
    let id = Text(id);
    select_tokens!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Token::from)
        .ok_or(StoreError::NotFound("token"))
}

/// Whatever it is worth.
pub(crate) async fn by_hash(
    connection: &mut SqliteConnection,
    hash: [u8; 32],
) -> Result<Option<Token>> {
    let hash = Bytes32(hash);
    let row = select_tokens!("WHERE hash = ?", hash)
        .fetch_optional(connection)
        .await?;
    Ok(row.map(Token::from))
}

/// What is kept of a token's text.
pub(crate) async fn hash_of(connection: &mut SqliteConnection, id: TokenId) -> Result<[u8; 32]> {
    let id = Text(id);
    sqlx::query_scalar!(
        r#"SELECT hash AS "hash: Bytes32" FROM tokens WHERE id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?
    .map(|hash| hash.0)
    .ok_or(StoreError::NotFound("token"))
}

/// How many of an owner are worth something at `now`.
pub(crate) async fn count_good(
    connection: &mut SqliteConnection,
    owner: TokenOwner,
    now: Timestamp,
) -> Result<i64> {
    let (kind, team, person, now) = (owner.kind(), owner.team(), owner.person(), Instant(now));
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) FROM tokens
           WHERE owner = ? AND team_id IS ? AND person_id IS ? AND revoked_at IS NULL
             AND (expires_at IS NULL OR expires_at > ?)"#,
        kind,
        team,
        person,
        now,
    )
    .fetch_one(connection)
    .await?)
}

/// [`StoreError::Conflict`] if there is one of this hash.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    token: &Token,
    hash: [u8; 32],
) -> Result<()> {
    let (id, hash, kind) = (Text(token.id), Bytes32(hash), token.kind.name());
    let owner = token.owner;
    let (owner_kind, team, person) = (owner.kind(), owner.team(), owner.person());
    let (created_at, expires_at) = (Instant(token.created_at), token.expires_at.map(Instant));
    sqlx::query!(
        "INSERT INTO tokens (id, hash, kind, owner, team_id, person_id, name, created_at, expires_at)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        id,
        hash,
        kind,
        owner_kind,
        team,
        person,
        token.name,
        created_at,
        expires_at,
    )
    .execute(connection)
    .await
    .map_err(taken)?;
    Ok(())
}

/// Gives a token another secret: the old one is worth nothing from then on.
pub(crate) async fn set_hash(
    connection: &mut SqliteConnection,
    id: TokenId,
    hash: [u8; 32],
) -> Result<()> {
    let (id, hash) = (Text(id), Bytes32(hash));
    sqlx::query!(
        "UPDATE tokens SET hash = ?, last_used_at = NULL WHERE id = ?",
        hash,
        id
    )
    .execute(connection)
    .await
    .map_err(taken)?;
    Ok(())
}

pub(crate) async fn set_last_used(
    connection: &mut SqliteConnection,
    id: TokenId,
    at: Timestamp,
) -> Result<()> {
    let (id, at) = (Text(id), Instant(at));
    sqlx::query!("UPDATE tokens SET last_used_at = ? WHERE id = ?", at, id)
        .execute(connection)
        .await?;
    Ok(())
}

pub(crate) async fn revoke(
    connection: &mut SqliteConnection,
    id: TokenId,
    at: Timestamp,
) -> Result<()> {
    let (id, at) = (Text(id), Instant(at));
    sqlx::query!(
        "UPDATE tokens SET revoked_at = ? WHERE id = ? AND revoked_at IS NULL",
        at,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// All of an owner, but the one with this id.
pub(crate) async fn revoke_others(
    connection: &mut SqliteConnection,
    owner: TokenOwner,
    kept: Option<TokenId>,
    at: Timestamp,
) -> Result<()> {
    let (kind, team, person, at) = (owner.kind(), owner.team(), owner.person(), Instant(at));
    let kept = kept.map(Text);
    sqlx::query!(
        "UPDATE tokens SET revoked_at = ?
         WHERE owner = ? AND team_id IS ? AND person_id IS ? AND revoked_at IS NULL AND id IS NOT ?",
        at,
        kind,
        team,
        person,
        kept,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Forgets what is worth nothing any more and was used last before `before`; who had which is in the events.
pub(crate) async fn forget(connection: &mut SqliteConnection, before: Timestamp) -> Result<()> {
    let before = Instant(before);
    sqlx::query!(
        "DELETE FROM tokens WHERE kind = 'session' AND (expires_at < ?1 OR revoked_at < ?1)",
        before
    )
    .execute(connection)
    .await?;
    Ok(())
}

fn taken(error: sqlx::Error) -> StoreError {
    if StoreError::is_duplicate(&error, "tokens.hash") {
        StoreError::Conflict("there is such a token: draw a new one".into())
    } else {
        error.into()
    }
}
