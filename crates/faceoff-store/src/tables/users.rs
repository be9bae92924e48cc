//! The table of users (in SQL `people`): the accounts of organisers and of the teams' members. Two names *look alike* if they have the
//! same skeleton ([`name_skeleton`]), for example `Team 0` and `Team O`.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    tables::tokens::Creator,
};
use faceoff_types::{TeamId, UserId, UserName, name_skeleton};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A user with an account: an organiser, or a member of one team for the whole season.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct User {
    pub id: UserId,
    /// The name to sign in with, unique regardless of case.
    pub name: UserName,
    /// The team of a member; `None` for an organiser.
    pub team: Option<TeamId>,
    /// When the invitation was accepted.
    pub joined_at: Timestamp,
    /// When the account was closed.
    pub left_at: Option<Timestamp>,
    /// False if the user can only use tokens.
    pub has_password: bool,
    /// The newest version of the terms that the user has accepted.
    pub accepted_terms: Option<u32>,
}

struct UserRow {
    id: UserId,
    name: UserName,
    team_id: Option<TeamId>,
    joined_at: Instant,
    left_at: Option<Instant>,
    has_password: bool,
    accepted_terms: Option<u32>,
}

impl From<UserRow> for User {
    fn from(row: UserRow) -> Self {
        Self {
            id: row.id,
            name: row.name,
            team: row.team_id,
            joined_at: row.joined_at.0,
            left_at: row.left_at.map(|at| at.0),
            has_password: row.has_password,
            accepted_terms: row.accepted_terms,
        }
    }
}

/// `SELECT` of whole users; the argument is the SQL after `FROM people`.
macro_rules! select_users {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            UserRow,
            r#"SELECT id, name, team_id, joined_at, left_at, password IS NOT NULL AS "has_password!: bool",
                      accepted_terms
               FROM people "# + $tail
            $(, $argument)*
        )
    };
}

/// All users, including those who have left, by name.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<User>> {
    let rows = select_users!("ORDER BY name").fetch_all(connection).await?;
    Ok(rows.into_iter().map(User::from).collect())
}

/// The members of a team, including those who have left, by name.
pub(crate) async fn of_team(connection: &mut SqliteConnection, team: TeamId) -> Result<Vec<User>> {
    let rows = select_users!("WHERE team_id = ? ORDER BY name", team)
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(User::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: UserId) -> Result<User> {
    select_users!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(User::from)
        .ok_or(StoreError::NotFound("user"))
}

/// The active user of this name, or of one that looks like it, with the hash of the password, if they have one.
pub(crate) async fn find_with_password(
    connection: &mut SqliteConnection,
    name: &str,
) -> Result<Option<(UserId, String)>> {
    // The name itself first: databases of earlier versions may have names that look alike.
    let rows = sqlx::query!(
        r#"SELECT id, name, password AS "password!" FROM people
           WHERE password IS NOT NULL AND left_at IS NULL ORDER BY name = ? DESC, name"#,
        name
    )
    .fetch_all(connection)
    .await?;
    let skeleton = name_skeleton(name);
    let row = rows
        .into_iter()
        .find(|row| name_skeleton(row.name.as_str()) == skeleton);
    Ok(row.map(|row| (row.id, row.password)))
}

/// The users who joined by invitations that this user has made, or that were made with this token. By name; also those who have
/// left.
pub(crate) async fn joined_by(
    connection: &mut SqliteConnection,
    creator: Creator,
) -> Result<Vec<User>> {
    invited(connection, creator, false).await
}

/// The users who got access again by links that this user has made, or that were made with this token. By name; also those who
/// have left.
pub(crate) async fn restored_by(
    connection: &mut SqliteConnection,
    creator: Creator,
) -> Result<Vec<User>> {
    invited(connection, creator, true).await
}

async fn invited(
    connection: &mut SqliteConnection,
    creator: Creator,
    restored: bool,
) -> Result<Vec<User>> {
    let rows = select_users!(
        "WHERE id IN (SELECT accepted_by FROM invitations
                      WHERE (made_by = ? OR made_with = ?) AND (role = 'return') = ?)
         ORDER BY name",
        creator.user,
        creator.token,
        restored
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(User::from).collect())
}

/// Checks that no other user has the name, or one that looks like it: [`StoreError::UserNameTaken`]. Users who have left count, since the
/// log shows their names.
async fn check_name_is_free(
    connection: &mut SqliteConnection,
    id: UserId,
    name: &UserName,
) -> Result<()> {
    let skeleton = name_skeleton(name.as_str());
    let names = sqlx::query_scalar!("SELECT name FROM people WHERE id <> ?", id);
    let names = names.fetch_all(connection).await?;
    let taken = names
        .into_iter()
        .find(|name| name_skeleton(name.as_str()) == skeleton);
    match taken {
        Some(taken) => Err(StoreError::UserNameTaken(taken.to_string())),
        None => Ok(()),
    }
}

/// Renames a user. [`StoreError::UserNameTaken`] if another user has the name, or one that looks like it.
pub(crate) async fn set_name(
    connection: &mut SqliteConnection,
    id: UserId,
    name: &UserName,
) -> Result<()> {
    check_name_is_free(&mut *connection, id, name).await?;
    let name = name.as_str();
    sqlx::query!("UPDATE people SET name = ? WHERE id = ?", name, id)
        .execute(connection)
        .await?;
    Ok(())
}

/// Adds a user. [`StoreError::UserNameTaken`] if a user has the name, or one that looks like it.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    user: &User,
    password_hash: Option<&str>,
) -> Result<()> {
    check_name_is_free(&mut *connection, user.id, &user.name).await?;
    sqlx::query!(
        "INSERT INTO people (id, name, team_id, joined_at, password, accepted_terms) VALUES (?, ?, ?, ?, ?, ?)",
        user.id,
        user.name.as_str(),
        user.team,
        Instant(user.joined_at),
        password_hash,
        user.accepted_terms,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The hash of an active user's password, if there is one.
pub(crate) async fn password_hash_of(
    connection: &mut SqliteConnection,
    id: UserId,
) -> Result<Option<String>> {
    let hash = sqlx::query_scalar!(
        "SELECT password FROM people WHERE id = ? AND left_at IS NULL",
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(hash.flatten())
}

pub(crate) async fn set_password(
    connection: &mut SqliteConnection,
    id: UserId,
    password_hash: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE people SET password = ? WHERE id = ?",
        password_hash,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_accepted_terms(
    connection: &mut SqliteConnection,
    id: UserId,
    version: u32,
) -> Result<()> {
    sqlx::query!(
        "UPDATE people SET accepted_terms = ? WHERE id = ?",
        version,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Closes an account: the user's password is removed.
pub(crate) async fn set_left(
    connection: &mut SqliteConnection,
    id: UserId,
    left_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE people SET left_at = ?, password = NULL WHERE id = ?",
        Instant(left_at),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Number of active organisers.
pub(crate) async fn count_organisers(connection: &mut SqliteConnection) -> Result<i64> {
    Ok(
        sqlx::query_scalar!(
            "SELECT COUNT(*) FROM people WHERE team_id IS NULL AND left_at IS NULL"
        )
        .fetch_one(connection)
        .await?,
    )
}

/// Does the team have active members, of whom none has accepted this version of the terms?
pub(crate) async fn lacks_accepted_terms(
    connection: &mut SqliteConnection,
    team: TeamId,
    version: u32,
) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM people WHERE team_id = ?1 AND left_at IS NULL)
              AND NOT EXISTS (SELECT 1 FROM people
                              WHERE team_id = ?1 AND left_at IS NULL AND accepted_terms >= ?2) AS "owes!: bool""#,
        team,
        version
    )
    .fetch_one(connection)
    .await?)
}
