use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{PersonId, PersonName, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// Somebody with an account: an organiser, or a member of one team for the whole season.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Person {
    pub id: PersonId,
    /// By which they sign in; unique whatever the case of its letters.
    pub name: PersonName,
    /// Whose member it is; none: an organiser.
    pub team: Option<TeamId>,
    /// When the invitation was accepted.
    pub joined_at: Timestamp,
    /// Since when they may do nothing any more.
    pub left_at: Option<Timestamp>,
    /// May they sign in by a password?
    pub has_password: bool,
    /// Which version of the terms they have accepted.
    pub accepted_terms: Option<u32>,
}

struct Row {
    id: Text<PersonId>,
    name: Text<PersonName>,
    team_id: Option<Text<TeamId>>,
    joined_at: Instant,
    left_at: Option<Instant>,
    has_password: bool,
    accepted_terms: Option<u32>,
}

impl From<Row> for Person {
    fn from(row: Row) -> Self {
        Self {
            id: row.id.0,
            name: row.name.0,
            team: row.team_id.map(|id| id.0),
            joined_at: row.joined_at.0,
            left_at: row.left_at.map(|at| at.0),
            has_password: row.has_password,
            accepted_terms: row.accepted_terms,
        }
    }
}

/// `SELECT` of whole people; the argument is what follows `FROM people`.
macro_rules! select_people {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            Row,
            r#"SELECT id AS "id: Text<PersonId>", name AS "name: Text<PersonName>",
                      team_id AS "team_id: Text<TeamId>", joined_at AS "joined_at: Instant",
                      left_at AS "left_at: Instant", password IS NOT NULL AS "has_password!: bool",
                      accepted_terms AS "accepted_terms: u32"
               FROM people "# + $tail
            $(, $argument)*
        )
    };
}

/// Everybody who has ever joined, by name.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Person>> {
    let rows = select_people!("ORDER BY name")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Person::from).collect())
}

/// The members that a team has and has had, by name.
pub(crate) async fn of_team(
    connection: &mut SqliteConnection,
    team: TeamId,
) -> Result<Vec<Person>> {
    let team = Text(team);
    let rows = select_people!("WHERE team_id = ? ORDER BY name", team)
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Person::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: PersonId) -> Result<Person> {
    let id = Text(id);
    select_people!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Person::from)
        .ok_or(StoreError::NotFound("person"))
}

/// The person of this name, with the hash of their password, if they are there and have one.
pub(crate) async fn with_password(
    connection: &mut SqliteConnection,
    name: &str,
) -> Result<Option<(PersonId, String)>> {
    let row = sqlx::query!(
        r#"SELECT id AS "id: Text<PersonId>", password AS "password!" FROM people
           WHERE name = ? AND password IS NOT NULL AND left_at IS NULL"#,
        name
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(|row| (row.id.0, row.password)))
}

/// [`StoreError::PersonNameTaken`] if the name exists, whatever its case.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    person: &Person,
    password: Option<&str>,
) -> Result<()> {
    let (id, name) = (Text(person.id), person.name.as_str());
    let (team, joined_at) = (person.team.map(Text), Instant(person.joined_at));
    sqlx::query!(
        "INSERT INTO people (id, name, team_id, joined_at, password, accepted_terms) VALUES (?, ?, ?, ?, ?, ?)",
        id,
        name,
        team,
        joined_at,
        password,
        person.accepted_terms,
    )
    .execute(connection)
    .await
    .map_err(|error| {
        if StoreError::is_duplicate(&error, "people.name") {
            StoreError::PersonNameTaken(person.name.to_string())
        } else {
            error.into()
        }
    })?;
    Ok(())
}

pub(crate) async fn set_password(
    connection: &mut SqliteConnection,
    id: PersonId,
    password: &str,
) -> Result<()> {
    let id = Text(id);
    sqlx::query!("UPDATE people SET password = ? WHERE id = ?", password, id)
        .execute(connection)
        .await?;
    Ok(())
}

pub(crate) async fn set_accepted_terms(
    connection: &mut SqliteConnection,
    id: PersonId,
    version: u32,
) -> Result<()> {
    let id = Text(id);
    sqlx::query!(
        "UPDATE people SET accepted_terms = ? WHERE id = ?",
        version,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_left(
    connection: &mut SqliteConnection,
    id: PersonId,
    at: Timestamp,
) -> Result<()> {
    let (id, at) = (Text(id), Instant(at));
    sqlx::query!(
        "UPDATE people SET left_at = ?, password = NULL WHERE id = ?",
        at,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Organisers who are there.
pub(crate) async fn organisers(connection: &mut SqliteConnection) -> Result<i64> {
    Ok(
        sqlx::query_scalar!(
            "SELECT COUNT(*) FROM people WHERE team_id IS NULL AND left_at IS NULL"
        )
        .fetch_one(connection)
        .await?,
    )
}

/// What of the terms somebody of the team must have accepted before it plays: has nobody who is there accepted
/// `version`, though the team has members?
pub(crate) async fn owes_terms(
    connection: &mut SqliteConnection,
    team: TeamId,
    version: u32,
) -> Result<bool> {
    let team = Text(team);
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
