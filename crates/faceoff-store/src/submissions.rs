use crate::{Event, Store, StoreError, column::Instant, season};
use faceoff_types::{BundleRef, SubmissionId, TeamId};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// One uploaded agent.
#[derive(Debug, Clone, PartialEq)]
pub struct Submission {
    /// Its id.
    pub id: SubmissionId,
    /// Whose it is.
    pub team: TeamId,
    /// What was uploaded.
    pub bundle: BundleRef,
    /// When.
    pub created_at: Timestamp,
    /// The agent's own name; known once the bundle was unpacked.
    pub agent_name: Option<String>,
    /// How far its smoke run is.
    pub state: SubmissionState,
}

/// A submission's way through its smoke run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum SubmissionState {
    /// The smoke run is queued or running.
    Validating {
        /// Smoke runs begun so far.
        attempts: u32,
    },
    /// It starts, answers and keeps time.
    Valid {
        /// Tail of the agent's standard error.
        log: String,
    },
    /// The team's fault.
    Invalid {
        /// What is wrong and where.
        reason: String,
        /// Tail of the agent's standard error.
        log: String,
    },
    /// Our fault, after several attempts; the team may upload again.
    ValidationError {
        /// What went wrong.
        reason: String,
    },
}

impl SubmissionState {
    /// Has the smoke run come to an end, whichever?
    #[must_use]
    pub const fn is_settled(&self) -> bool {
        !matches!(self, Self::Validating { .. })
    }
}

pub(crate) struct SubmissionRow {
    id: Text<SubmissionId>,
    team_id: Text<TeamId>,
    bundle_key: String,
    bundle_bytes: u64,
    bundle_blake3: String,
    bundle_file_name: String,
    created_at: Instant,
    agent_name: Option<String>,
    state: String,
    reason: Option<String>,
    log: Option<String>,
    attempts: u32,
}

impl TryFrom<SubmissionRow> for Submission {
    type Error = StoreError;

    fn try_from(row: SubmissionRow) -> Result<Self, StoreError> {
        let state = match (row.state.as_str(), row.reason, row.log) {
            ("validating", None, None) => SubmissionState::Validating {
                attempts: row.attempts,
            },
            ("valid", None, Some(log)) => SubmissionState::Valid { log },
            ("invalid", Some(reason), Some(log)) => SubmissionState::Invalid { reason, log },
            ("validation_error", Some(reason), None) => SubmissionState::ValidationError { reason },
            (state, ..) => {
                return Err(StoreError::Damaged(format!(
                    "submission {}: state {state:?} with other data than it has",
                    row.id.0
                )));
            }
        };
        Ok(Self {
            id: row.id.0,
            team: row.team_id.0,
            bundle: BundleRef {
                key: row.bundle_key,
                bytes: row.bundle_bytes,
                blake3: row.bundle_blake3,
                file_name: row.bundle_file_name,
            },
            created_at: row.created_at.0,
            agent_name: row.agent_name,
            state,
        })
    }
}

/// `SELECT` of whole submissions `s`; the argument is what follows `FROM submissions s`.
macro_rules! select_submissions {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            SubmissionRow,
            r#"SELECT s.id AS "id: Text<SubmissionId>", s.team_id AS "team_id: Text<TeamId>",
                      s.bundle_key, s.bundle_bytes AS "bundle_bytes: u64", s.bundle_blake3,
                      s.bundle_file_name, s.created_at AS "created_at: Instant",
                      s.agent_name, s.state, s.reason, s.log,
                      (SELECT COALESCE(SUM(u.attempts), 0) FROM work_units u
                       WHERE u.submission_id = s.id AND u.kind = 'smoke') AS "attempts!: u32"
               FROM submissions s "# + $tail
            $(, $argument)*
        )
    };
}

/// Reads one submission within a transaction or from the pool.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: SubmissionId,
) -> Result<Submission, StoreError> {
    let id = Text(id);
    select_submissions!("WHERE s.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("submission"))?
        .try_into()
}

/// The newest valid submission of each team whose turn of `day` is free, earliest first; of those
/// uploaded before `released_at`, when the day's seed became known.
pub(crate) async fn awaiting_turn(
    connection: &mut SqliteConnection,
    day: Date,
    released_at: Option<Timestamp>,
) -> Result<Vec<Submission>, StoreError> {
    let (day, released_at) = (Text(day), Instant(released_at.unwrap_or(Timestamp::MAX)));
    select_submissions!(
        "WHERE s.state = 'valid' AND s.created_at < ?1
           AND NOT EXISTS (SELECT 1 FROM submissions n
                           WHERE n.team_id = s.team_id AND n.state = 'valid'
                             AND n.created_at < ?1 AND (n.created_at, n.id) > (s.created_at, s.id))
           AND NOT EXISTS (SELECT 1 FROM evaluations e
                           WHERE e.team_id = s.team_id AND e.day = ?2
                             AND e.state NOT IN ('platform_failed', 'cancelled'))
         ORDER BY s.created_at, s.id",
        released_at,
        day
    )
    .fetch_all(connection)
    .await?
    .into_iter()
    .map(Submission::try_from)
    .collect()
}

impl Store {
    /// Records an uploaded bundle whose bytes are an artifact already, and queues its smoke run.
    /// [`StoreError::SeasonClosed`] once the season is over.
    pub async fn create_submission(
        &self,
        team: TeamId,
        bundle: BundleRef,
        now: Timestamp,
    ) -> Result<Submission, StoreError> {
        let id = SubmissionId::new();
        let bytes = i64::try_from(bundle.bytes)
            .map_err(|_| StoreError::Conflict("the bundle is larger than any disk".into()))?;
        let (id_text, team, unit, now) = (Text(id), Text(team), Text(Uuid::now_v7()), Instant(now));
        let mut tx = self.database.begin().await?;
        season::check_open(&mut tx).await?;
        sqlx::query_scalar!(r#"SELECT 1 AS "found!: i64" FROM teams WHERE id = ?"#, team)
            .fetch_optional(&mut *tx)
            .await?
            .ok_or(StoreError::NotFound("team"))?;
        sqlx::query!(
            "INSERT INTO submissions (id, team_id, bundle_key, bundle_bytes, bundle_blake3,
                                      bundle_file_name, created_at, state)
             VALUES (?, ?, ?, ?, ?, ?, ?, 'validating')",
            id_text,
            team,
            bundle.key,
            bytes,
            bundle.blake3,
            bundle.file_name,
            now,
        )
        .execute(&mut *tx)
        .await?;
        sqlx::query!(
            "INSERT INTO work_units (id, kind, submission_id, state, claimable_at)
             VALUES (?, 'smoke', ?, 'queued', ?)",
            unit,
            id_text,
            now,
        )
        .execute(&mut *tx)
        .await?;
        let submission = find(&mut tx, id).await?;
        tx.commit().await?;
        self.signals.work_added();
        self.signals.changed(Event::Submission(id));
        Ok(submission)
    }

    /// The submission with this id.
    pub async fn submission(&self, id: SubmissionId) -> Result<Submission, StoreError> {
        find(&mut *self.database.read.acquire().await?, id).await
    }

    /// A team's submissions, newest first.
    pub async fn submissions_of(&self, team: TeamId) -> Result<Vec<Submission>, StoreError> {
        let team = Text(team);
        select_submissions!(
            "WHERE s.team_id = ? ORDER BY s.created_at DESC, s.id DESC",
            team
        )
        .fetch_all(&self.database.read)
        .await?
        .into_iter()
        .map(Submission::try_from)
        .collect()
    }
}
