//! The table of teams: the season's participants, each with a unique name. Boards rank them by their agents' evaluations.

use crate::{
    column::Instant,
    error::{Result, StoreError},
    tables::{decision_records::DecisionRecord, terms, users},
};
use faceoff_types::{DivisionName, StageName, TeamId, TeamName, name_skeleton};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// A participant of the season: it submits agents, which are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Team {
    /// Does not change when the team is renamed or gets another token.
    pub id: TeamId,
    /// Shown on boards; unique regardless of case.
    pub name: TeamName,
    pub created_at: Timestamp,
    /// Set while the team is disqualified: it is neither evaluated nor ranked.
    pub disqualified: Option<DecisionRecord>,
    pub profile: TeamProfile,
    /// When the team retired from the season; its results stay.
    pub retired_at: Option<Timestamp>,
    /// A reference agent of the organisers: it is evaluated as others are, and not ranked.
    pub is_baseline: bool,
}

/// A team's description of itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TeamProfile {
    pub affiliation: Option<String>,
    /// Address of its web page, http or https.
    pub link: Option<String>,
    pub division: Option<DivisionName>,
}

struct TeamRow {
    id: TeamId,
    name: TeamName,
    created_at: Instant,
    disqualified_at: Option<Instant>,
    disqualified_for: Option<String>,
    affiliation: Option<String>,
    link: Option<String>,
    division: Option<DivisionName>,
    retired_at: Option<Instant>,
    is_baseline: bool,
}

impl From<TeamRow> for Team {
    fn from(row: TeamRow) -> Self {
        Self {
            id: row.id,
            name: row.name,
            created_at: row.created_at.0,
            disqualified: DecisionRecord::from_columns(row.disqualified_at, row.disqualified_for),
            profile: TeamProfile {
                affiliation: row.affiliation,
                link: row.link,
                division: row.division,
            },
            retired_at: row.retired_at.map(|at| at.0),
            is_baseline: row.is_baseline,
        }
    }
}

/// `SELECT` of whole teams; the argument is the SQL after `FROM teams`.
macro_rules! select_teams {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            TeamRow,
            "SELECT id, name, created_at, disqualified_at, disqualified_for, affiliation, link, division, retired_at,
                    is_baseline
             FROM teams " + $tail
            $(, $argument)*
        )
    };
}

/// All teams, by name.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Team>> {
    let teams = select_teams!("ORDER BY name").fetch_all(connection).await?;
    Ok(teams.into_iter().map(Team::from).collect())
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: TeamId) -> Result<Team> {
    select_teams!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Team::from)
        .ok_or(StoreError::NotFound("team"))
}

/// Adds a team. [`StoreError::TeamNameTaken`] if a team has the name, or one that looks like it.
pub(crate) async fn insert(connection: &mut SqliteConnection, team: &Team) -> Result<()> {
    check_name(connection, Some(team.id), &team.name).await?;
    let division = team.profile.division.as_ref().map(DivisionName::as_str);
    sqlx::query!(
        "INSERT INTO teams (id, name, created_at, affiliation, link, division) VALUES (?, ?, ?, ?, ?, ?)",
        team.id,
        &team.name,
        Instant(team.created_at),
        team.profile.affiliation,
        team.profile.link,
        division,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Renames a team. [`StoreError::TeamNameTaken`] if another team has this name, or one that looks like it.
pub(crate) async fn set_name(
    connection: &mut SqliteConnection,
    id: TeamId,
    name: &TeamName,
) -> Result<()> {
    check_name(connection, Some(id), name).await?;
    let text = name.as_str();
    sqlx::query!("UPDATE teams SET name = ? WHERE id = ?", text, id)
        .execute(connection)
        .await?;
    Ok(())
}

pub(crate) async fn set_profile(
    connection: &mut SqliteConnection,
    id: TeamId,
    profile: &TeamProfile,
) -> Result<()> {
    let division = profile.division.as_ref().map(DivisionName::as_str);
    sqlx::query!(
        "UPDATE teams SET affiliation = ?, link = ?, division = ? WHERE id = ?",
        profile.affiliation,
        profile.link,
        division,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Retires a team from `retired_at`, by its own decision or an organiser's; `None` revokes its retirement.
pub(crate) async fn set_retired(
    connection: &mut SqliteConnection,
    id: TeamId,
    retired_at: Option<Timestamp>,
    is_by_organiser: bool,
) -> Result<()> {
    let is_by_organiser = is_by_organiser && retired_at.is_some();
    sqlx::query!(
        "UPDATE teams SET retired_at = ?, retired_by_organiser = ? WHERE id = ?",
        retired_at.map(Instant),
        is_by_organiser,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_baseline(
    connection: &mut SqliteConnection,
    id: TeamId,
    is_baseline: bool,
) -> Result<()> {
    sqlx::query!(
        "UPDATE teams SET is_baseline = ? WHERE id = ?",
        is_baseline,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The name of a signed-off stage whose boards include the team, if there is one.
pub(crate) async fn signed_off_stage(
    connection: &mut SqliteConnection,
    id: TeamId,
) -> Result<Option<StageName>> {
    Ok(sqlx::query_scalar!(
        "SELECT g.name FROM stages g
         WHERE g.finalised_at IS NOT NULL
           AND EXISTS (SELECT 1 FROM counting_evaluations e
                       WHERE e.team_id = ? AND e.stage_id = g.id AND e.state = 'finished' AND e.voided_at IS NULL)
         LIMIT 1",
        id
    )
    .fetch_optional(connection)
    .await?)
}

/// Why a team's files are kept as evidence, regardless of retention.
#[derive(Debug)]
pub(crate) enum Evidence {
    /// The team is disqualified.
    Disqualified(DecisionRecord),
    /// An organiser retired the team at this time.
    Retired(Timestamp),
}

pub(crate) async fn evidence(
    connection: &mut SqliteConnection,
    id: TeamId,
) -> Result<Option<Evidence>> {
    let row = sqlx::query!(
        "SELECT disqualified_at, disqualified_for, retired_at, retired_by_organiser AS by_organiser
         FROM teams WHERE id = ?",
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("team"))?;
    if let Some(decision) = DecisionRecord::from_columns(row.disqualified_at, row.disqualified_for)
    {
        return Ok(Some(Evidence::Disqualified(decision)));
    }
    let retired_at = row.retired_at.filter(|_| row.by_organiser);
    Ok(retired_at.map(|at| Evidence::Retired(at.0)))
}

/// Disqualifies a team by the decision; `None` reinstates it.
pub(crate) async fn set_disqualified(
    connection: &mut SqliteConnection,
    id: TeamId,
    decision: Option<&DecisionRecord>,
) -> Result<()> {
    let disqualified_at = decision.map(|decision| Instant(decision.at));
    let reason = decision.map(|decision| &decision.reason);
    sqlx::query!(
        "UPDATE teams SET disqualified_at = ?, disqualified_for = ? WHERE id = ?",
        disqualified_at,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Refuses a team that is disqualified, has retired, or has not accepted the terms.
pub(crate) async fn check_may_compete(connection: &mut SqliteConnection, id: TeamId) -> Result<()> {
    let team = find(connection, id).await?;
    if let Some(DecisionRecord { at, reason }) = team.disqualified {
        return Err(StoreError::Disqualified { at, reason });
    }
    if let Some(at) = team.retired_at {
        return Err(StoreError::TeamRetired { at });
    }
    match terms::newest(connection).await? {
        Some(version) if users::lacks_accepted_terms(connection, id, version).await? => {
            Err(StoreError::TermsNotAccepted { version })
        }
        _ => Ok(()),
    }
}

/// [`StoreError::TeamNameTaken`] if another team has the name, or one that looks like it (has the same skeleton).
pub(crate) async fn check_name(
    connection: &mut SqliteConnection,
    id: Option<TeamId>,
    name: &TeamName,
) -> Result<()> {
    let skeleton = name_skeleton(name.as_str());
    let others = sqlx::query_scalar!("SELECT name FROM teams WHERE id IS NOT ?", id);
    let others = others.fetch_all(connection).await?;
    match others
        .into_iter()
        .find(|other| name_skeleton(other.as_str()) == skeleton)
    {
        Some(other) => Err(StoreError::TeamNameTaken(other.to_string())),
        None => Ok(()),
    }
}
