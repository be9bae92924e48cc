//! The table of submissions: the agents that teams have uploaded, with the outcome of their validation.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    event::Actor,
    tables::decision_records::DecisionRecord,
};
use faceoff_types::{BundleRef, IdempotencyKey, SubmissionId, TeamId, ValidationTiming};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// An agent that a team has uploaded.
#[derive(Debug, Clone, PartialEq)]
pub struct Submission {
    pub id: SubmissionId,
    pub team: TeamId,
    pub bundle: BundleRef,
    /// When its upload was complete.
    pub created_at: Timestamp,
    /// The name in the agent's manifest; known once the bundle was unpacked.
    pub agent_name: Option<String>,
    /// The runtime in the manifest; unknown before unpacking, and for submissions validated by older versions.
    pub runtime: Option<String>,
    /// State of its validation.
    pub state: SubmissionState,
    /// Response times in the validation run, for each task that was played.
    pub timing: Vec<ValidationTiming>,
    /// Is it its team's active submission, which is evaluated at the next cutoff?
    pub active: bool,
    /// When its team withdrew it; it is not evaluated again unless the team chooses it again.
    pub withdrawn_at: Option<Timestamp>,
    /// A label set by its team.
    pub label: Option<String>,
    /// A note written by its team.
    pub note: Option<String>,
    /// The team's first submission of the same bundle, if this is a later one.
    pub duplicate_of: Option<SubmissionId>,
    /// Set if its bundle was removed: it cannot be evaluated any more.
    pub bundle_removed: Option<DecisionRecord>,
    /// Set if the bundle was removed on request of its team or of an organiser, and not by the stage's retention.
    pub deletion_request: Option<DeletionRequest>,
}

/// The requested removal of a submission's bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeletionRequest {
    pub requested_at: Timestamp,
    pub actor: Actor,
}

/// State of a submission's validation. [`Store::submission_log`](crate::Store::submission_log) reads the agent's
/// log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SubmissionState {
    /// The validation run is queued or running.
    Validating,
    /// The agent starts, responds, and meets its time limits.
    Valid,
    Invalid {
        /// The fault and its location.
        reason: String,
    },
    /// Given up after platform faults in several attempts; the team may upload again.
    PlatformFailed { reason: String },
}

impl SubmissionState {
    /// Has the validation run ended?
    #[must_use]
    pub const fn validation_is_over(&self) -> bool {
        !matches!(self, Self::Validating)
    }
}

/// Reason of the removal of a bundle that did not pass its validation run.
pub(crate) const REMOVED_AS_INVALID: &str = "because its validation run failed";

struct SubmissionRow {
    id: SubmissionId,
    team_id: TeamId,
    bundle_key: String,
    bundle_bytes: u64,
    bundle_blake3: String,
    bundle_file_name: String,
    created_at: Instant,
    agent_name: Option<String>,
    runtime: Option<String>,
    state: String,
    reason: Option<String>,
    timing: Option<Json<Vec<ValidationTiming>>>,
    active: bool,
    withdrawn_at: Option<Instant>,
    label: Option<String>,
    note: Option<String>,
    same_as: Option<SubmissionId>,
    removed_at: Option<Instant>,
    removed_for: Option<String>,
    deleted_at: Option<Instant>,
    deleted_by: Option<Actor>,
}

impl TryFrom<SubmissionRow> for Submission {
    type Error = StoreError;

    fn try_from(row: SubmissionRow) -> Result<Self> {
        let state = match (row.state.as_str(), row.reason) {
            ("validating", None) => SubmissionState::Validating,
            ("valid", None) => SubmissionState::Valid,
            ("invalid", Some(reason)) => SubmissionState::Invalid { reason },
            ("validation_error", Some(reason)) => SubmissionState::PlatformFailed { reason },
            (state, _) => {
                return Err(StoreError::Damaged(format!(
                    "submission {}: state {state:?} does not match its reason",
                    row.id
                )));
            }
        };
        Ok(Self {
            id: row.id,
            team: row.team_id,
            bundle: BundleRef {
                key: row.bundle_key,
                bytes: row.bundle_bytes,
                blake3: row.bundle_blake3,
                file_name: row.bundle_file_name,
            },
            created_at: row.created_at.0,
            agent_name: row.agent_name,
            runtime: row.runtime,
            state,
            timing: row.timing.map_or_else(Vec::new, |timing| timing.0),
            active: row.active,
            withdrawn_at: row.withdrawn_at.map(|at| at.0),
            label: row.label,
            note: row.note,
            duplicate_of: row.same_as,
            bundle_removed: row.removed_at.map(|at| DecisionRecord {
                at: at.0,
                reason: row
                    .removed_for
                    .unwrap_or_else(|| REMOVED_AS_INVALID.to_owned()),
            }),
            deletion_request: row.deleted_at.zip(row.deleted_by).map(|(at, actor)| {
                DeletionRequest {
                    requested_at: at.0,
                    actor,
                }
            }),
        })
    }
}

/// `SELECT` of submissions `s` without their logs; the argument is the SQL after `FROM submissions s`.
macro_rules! select_submissions {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            SubmissionRow,
            r#"SELECT s.id, s.team_id,
                      s.bundle_key, s.bundle_bytes, s.bundle_blake3,
                      s.bundle_file_name, s.created_at,
                      s.agent_name, s.runtime, s.state, s.reason,
                      s.timing,
                      EXISTS (SELECT 1 FROM active_submissions a
                              WHERE a.team_id = s.team_id AND a.submission_id = s.id)
                      AS "active!: bool",
                      s.withdrawn_at, s.label, s.note,
                      (SELECT o.id FROM submissions o
                       WHERE o.team_id = s.team_id AND o.bundle_blake3 = s.bundle_blake3
                         AND (o.created_at, o.id) < (s.created_at, s.id)
                       ORDER BY o.created_at, o.id LIMIT 1) AS "same_as: SubmissionId",
                      s.bundle_removed_at AS removed_at, s.bundle_removed_for AS removed_for,
                      s.deleted_at, s.deleted_by
               FROM submissions s "# + $tail
            $(, $argument)*
        )
    };
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<Submission> {
    select_submissions!("WHERE s.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("submission"))?
        .try_into()
}

/// A team's submissions, the newest first.
pub(crate) async fn of_team(
    connection: &mut SqliteConnection,
    team: TeamId,
) -> Result<Vec<Submission>> {
    select_submissions!(
        "WHERE s.team_id = ? ORDER BY s.created_at DESC, s.id DESC",
        team
    )
    .fetch_all(connection)
    .await?
    .into_iter()
    .map(Submission::try_from)
    .collect()
}

/// When the submission was uploaded; `None` if the id is unknown.
pub(crate) async fn created_at(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<Option<Timestamp>> {
    let at = sqlx::query_scalar!("SELECT created_at AS at FROM submissions WHERE id = ?", id);
    Ok(at.fetch_optional(connection).await?.map(|at| at.0))
}

/// One page of a team's submissions, the newest first: those that follow the submission with this time of the upload and
/// this id.
pub(crate) async fn of_team_after(
    connection: &mut SqliteConnection,
    team: TeamId,
    (uploaded_at, id): (Timestamp, Option<SubmissionId>),
    limit: u32,
) -> Result<Vec<Submission>> {
    select_submissions!(
        "WHERE s.team_id = ?1 AND s.created_at <= ?2 AND (s.created_at < ?2 OR ?3 IS NULL OR s.id < ?3)
         ORDER BY s.created_at DESC, s.id DESC LIMIT ?4",
        team,
        Instant(uploaded_at),
        id,
        limit
    )
    .fetch_all(connection)
    .await?
    .into_iter()
    .map(Submission::try_from)
    .collect()
}

/// The active submission of each team that may compete, the earliest upload first.
pub(crate) async fn active(connection: &mut SqliteConnection) -> Result<Vec<Submission>> {
    select_submissions!(
        "WHERE s.id IN (SELECT a.submission_id FROM active_submissions a JOIN teams t ON t.id = a.team_id
                         WHERE t.disqualified_at IS NULL AND t.retired_at IS NULL)
         ORDER BY s.created_at, s.id"
    )
    .fetch_all(connection)
    .await?
    .into_iter()
    .map(Submission::try_from)
    .collect()
}

/// The agent's standard error in the validation run; `None` before its end, and after a platform fault. Invalid submissions of
/// identical bundles share the newest log.
pub(crate) async fn log(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<Option<String>> {
    sqlx::query_scalar!(
        r#"SELECT CASE WHEN s.state = 'invalid' AND s.log = ''
                  THEN COALESCE((SELECT o.log FROM submissions o
                                 WHERE o.team_id = s.team_id AND o.bundle_blake3 = s.bundle_blake3
                                   AND o.state = 'invalid' AND o.log <> ''
                                 ORDER BY o.created_at DESC, o.id DESC LIMIT 1), '')
                  ELSE s.log END AS "log: String"
           FROM submissions s WHERE s.id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("submission"))
}

/// Empties all but the newest log of the team's invalid submissions of the bundle of this submission: [`log`] finds that for all.
pub(crate) async fn share_log(connection: &mut SqliteConnection, id: SubmissionId) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions AS old SET log = ''
         WHERE old.team_id = (SELECT team_id FROM submissions WHERE id = ?1)
           AND old.bundle_blake3 = (SELECT bundle_blake3 FROM submissions WHERE id = ?1)
           AND old.state = 'invalid' AND old.log <> ''
           AND EXISTS (SELECT 1 FROM submissions new
                       WHERE new.team_id = old.team_id AND new.bundle_blake3 = old.bundle_blake3
                         AND new.state = 'invalid' AND new.log <> ''
                         AND (new.created_at, new.id) > (old.created_at, old.id))",
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Empties the logs of this submission's team's invalid submissions, except the newest `kept`.
pub(crate) async fn empty_old_logs(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    kept: u32,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET log = '' WHERE id IN (
             SELECT id FROM submissions
             WHERE team_id = (SELECT team_id FROM submissions WHERE id = ?) AND state = 'invalid' AND log <> ''
             ORDER BY created_at DESC, id DESC LIMIT -1 OFFSET ?)",
        id,
        kept
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Adds an uploaded submission that is to be validated.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    team: TeamId,
    bundle: &BundleRef,
    key: Option<&IdempotencyKey>,
    now: Timestamp,
) -> Result<()> {
    let key = key.map(IdempotencyKey::as_str);
    let bytes = i64::try_from(bundle.bytes)
        .map_err(|_| StoreError::Conflict("the bundle is larger than any disk".into()))?;
    sqlx::query!(
        "INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3,
                                  bundle_file_name, idempotency_key, created_at, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, 'validating')",
        id,
        team,
        bundle.key,
        bytes,
        bundle.blake3,
        bundle.file_name,
        key,
        Instant(now),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The team's submission that was uploaded with this key.
pub(crate) async fn with_idempotency_key(
    connection: &mut SqliteConnection,
    team: TeamId,
    key: &IdempotencyKey,
) -> Result<Option<Submission>> {
    select_submissions!(
        "WHERE s.team_id = ? AND s.idempotency_key = ?",
        team,
        key.as_str()
    )
    .fetch_optional(connection)
    .await?
    .map(Submission::try_from)
    .transpose()
}

pub(crate) async fn set_valid(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    (agent_name, runtime): (&str, &str),
    timing: &[ValidationTiming],
    log: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET state = 'valid', agent_name = ?, runtime = ?, timing = ?, log = ? WHERE id = ?",
        agent_name,
        runtime,
        Json(timing),
        log,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_invalid(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    (agent_name, runtime): (Option<&str>, Option<&str>),
    reason: &str,
    timing: &[ValidationTiming],
    log: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET state = 'invalid', agent_name = ?, runtime = ?, reason = ?, timing = ?, log = ?
         WHERE id = ?",
        agent_name,
        runtime,
        reason,
        Json(timing),
        log,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_validation_error(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    reason: &str,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET state = 'validation_error', reason = ? WHERE id = ?",
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Withdraws a submission, or revokes the withdrawal.
pub(crate) async fn set_withdrawn(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    withdrawn_at: Option<Timestamp>,
) -> Result<()> {
    sqlx::query!(
        "UPDATE submissions SET withdrawn_at = ? WHERE id = ?",
        withdrawn_at.map(Instant),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_label(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    label: Option<&str>,
) -> Result<()> {
    sqlx::query!("UPDATE submissions SET label = ? WHERE id = ?", label, id)
        .execute(connection)
        .await?;
    Ok(())
}

pub(crate) async fn set_note(
    connection: &mut SqliteConnection,
    id: SubmissionId,
    note: Option<&str>,
) -> Result<()> {
    sqlx::query!("UPDATE submissions SET note = ? WHERE id = ?", note, id)
        .execute(connection)
        .await?;
    Ok(())
}
