//! The table of registrations: requests of new teams to take part, on which the organisers decide.

use crate::{
    column::{Bytes32, Instant},
    error::{Result, StoreError},
};
use faceoff_types::{DivisionName, RegistrationId, TeamId, TeamName};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// State of a registration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RegistrationState {
    /// An organiser has to decide.
    Pending,
    /// The team was created; the code in the registration's link now invites its first member.
    Approved {
        /// When it was approved.
        at: Timestamp,
        team: TeamId,
    },
    Refused {
        /// When it was refused.
        at: Timestamp,
        /// Shown to the person who registered.
        reason: String,
    },
}

/// A request to add a team to the season.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Registration {
    /// Not secret: the code in the link cannot be derived from it.
    pub id: RegistrationId,
    /// The requested name.
    pub team_name: TeamName,
    pub affiliation: Option<String>,
    pub link: Option<String>,
    /// The requested division.
    pub division: Option<DivisionName>,
    /// Contact address; visible to organisers only.
    pub contact: String,
    /// Version of the terms that was accepted.
    pub accepted_terms: Option<u32>,
    pub created_at: Timestamp,
    pub state: RegistrationState,
}

struct RegistrationRow {
    id: RegistrationId,
    team_name: TeamName,
    affiliation: Option<String>,
    link: Option<String>,
    division: Option<DivisionName>,
    contact: String,
    accepted_terms: Option<u32>,
    created_at: Instant,
    decided_at: Option<Instant>,
    reason: Option<String>,
    team_id: Option<TeamId>,
}

impl From<RegistrationRow> for Registration {
    fn from(row: RegistrationRow) -> Self {
        let state = match (row.decided_at, row.team_id, row.reason) {
            (Some(at), Some(team), _) => RegistrationState::Approved { at: at.0, team },
            (Some(at), None, Some(reason)) => RegistrationState::Refused { at: at.0, reason },
            _ => RegistrationState::Pending,
        };
        Self {
            id: row.id,
            team_name: row.team_name,
            affiliation: row.affiliation,
            link: row.link,
            division: row.division,
            contact: row.contact,
            accepted_terms: row.accepted_terms,
            created_at: row.created_at.0,
            state,
        }
    }
}

/// `SELECT` of whole registrations; the argument is the SQL after `FROM registrations`.
macro_rules! select_registrations {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            RegistrationRow,
            "SELECT id, team_name, affiliation, link, division, contact, accepted_terms, created_at, decided_at,
                    reason, team_id
             FROM registrations " + $tail
            $(, $argument)*
        )
    };
}

/// All registrations, the newest first.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<Registration>> {
    let rows = select_registrations!("ORDER BY created_at DESC, id DESC")
        .fetch_all(connection)
        .await?;
    Ok(rows.into_iter().map(Registration::from).collect())
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: RegistrationId,
) -> Result<Registration> {
    select_registrations!("WHERE id = ?", id)
        .fetch_optional(connection)
        .await?
        .map(Registration::from)
        .ok_or(StoreError::NotFound("registration"))
}

pub(crate) async fn by_code(
    connection: &mut SqliteConnection,
    code_hash: [u8; 32],
) -> Result<Option<Registration>> {
    let row = select_registrations!("WHERE code_hash = ?", Bytes32(code_hash))
        .fetch_optional(connection)
        .await?;
    Ok(row.map(Registration::from))
}

/// The hash of the code in the link that the person who registered has.
pub(crate) async fn code_hash(
    connection: &mut SqliteConnection,
    id: RegistrationId,
) -> Result<[u8; 32]> {
    let hash = sqlx::query_scalar!(
        "SELECT code_hash AS hash FROM registrations WHERE id = ?",
        id
    )
    .fetch_one(connection)
    .await?;
    Ok(hash.0)
}

pub(crate) async fn count_pending(connection: &mut SqliteConnection) -> Result<i64> {
    Ok(
        sqlx::query_scalar!("SELECT COUNT(*) FROM registrations WHERE state = 'waiting'")
            .fetch_one(connection)
            .await?,
    )
}

/// The names of the teams whose registrations are pending.
pub(crate) async fn pending_names(connection: &mut SqliteConnection) -> Result<Vec<TeamName>> {
    Ok(
        sqlx::query_scalar!("SELECT team_name FROM registrations WHERE state = 'waiting'")
            .fetch_all(connection)
            .await?,
    )
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    registration: &Registration,
    code_hash: [u8; 32],
) -> Result<()> {
    let division = registration.division.as_ref().map(DivisionName::as_str);
    sqlx::query!(
        "INSERT INTO registrations (id, code_hash, team_name, affiliation, link, division, contact, accepted_terms,
                                    created_at, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, 'waiting')",
        registration.id,
        Bytes32(code_hash),
        registration.team_name.as_str(),
        registration.affiliation,
        registration.link,
        division,
        registration.contact,
        registration.accepted_terms,
        Instant(registration.created_at),
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_approved(
    connection: &mut SqliteConnection,
    id: RegistrationId,
    team: TeamId,
    approved_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE registrations SET state = 'approved', decided_at = ?, team_id = ? WHERE id = ?",
        Instant(approved_at),
        team,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_refused(
    connection: &mut SqliteConnection,
    id: RegistrationId,
    reason: &str,
    refused_at: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE registrations SET state = 'refused', decided_at = ?, reason = ? WHERE id = ?",
        Instant(refused_at),
        reason,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
