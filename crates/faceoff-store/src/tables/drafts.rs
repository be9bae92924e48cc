//! The evaluations of proposals. They become evaluations of the same id if they are applied.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::{
        evaluations::{EvaluationState, Failure},
        runs::RunState,
    },
};
use faceoff_types::{EvaluationId, EvaluationResult, ProposalId, RunId, SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// An evaluation that does not count.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Of the evaluation that it becomes.
    pub id: EvaluationId,
    /// What it is a part of.
    pub proposal: ProposalId,
    pub submission: SubmissionId,
    pub team: TeamId,
    /// The evaluation that it plays again; `None` in a trial.
    pub replaces: Option<EvaluationId>,
    /// Its episodes and shards.
    pub run: RunId,
    /// When it was queued.
    pub created_at: Timestamp,
    /// How far it is, or what came of it.
    pub state: EvaluationState,
}

/// A draft with its run, without the run's progress.
pub(crate) struct DraftRow {
    id: Text<EvaluationId>,
    pub(crate) proposal: Text<ProposalId>,
    submission: Text<SubmissionId>,
    team: Text<TeamId>,
    replaces: Option<Text<EvaluationId>>,
    pub(crate) run: Text<RunId>,
    run_state: RunState,
    episodes_total: u32,
    created_at: Instant,
    state: String,
    finished_at: Option<Instant>,
    reason: Option<String>,
    dataset: Option<String>,
    dataset_blake3: Option<String>,
    result: Option<Json<EvaluationResult>>,
}

impl DraftRow {
    pub(crate) fn into_draft(self, episodes_done: u32) -> Result<Draft> {
        let id = self.id.0;
        let damaged = || StoreError::Damaged(format!("draft {id}: {} and half made", self.state));
        let finished_at = self.finished_at.map(|at| at.0);
        let state = match (self.state.as_str(), finished_at) {
            ("open", None) => match self.run_state {
                RunState::Queued => EvaluationState::Queued,
                RunState::Running => EvaluationState::Running {
                    episodes_done: episodes_done.min(self.episodes_total),
                    episodes_total: self.episodes_total,
                },
                RunState::Played => EvaluationState::Finalising,
                RunState::Stopped => return Err(damaged()),
            },
            ("finished", Some(finished_at)) => EvaluationState::Finished {
                finished_at,
                result: Box::new(self.result.ok_or_else(damaged)?.0),
                dataset: self.dataset.ok_or_else(damaged)?,
                dataset_blake3: self.dataset_blake3,
            },
            ("agent_failed", Some(finished_at)) => EvaluationState::AgentFailed { finished_at },
            ("platform_failed", Some(finished_at)) => EvaluationState::PlatformFailed {
                finished_at,
                reason: self.reason.ok_or_else(damaged)?,
            },
            ("cancelled", Some(finished_at)) => EvaluationState::Cancelled {
                finished_at,
                reason: self.reason.ok_or_else(damaged)?,
            },
            _ => return Err(damaged()),
        };
        Ok(Draft {
            id,
            proposal: self.proposal.0,
            submission: self.submission.0,
            team: self.team.0,
            replaces: self.replaces.map(|id| id.0),
            run: self.run.0,
            created_at: self.created_at.0,
            state,
        })
    }
}

/// `SELECT` of drafts with their runs; the arguments are what follows the tables, and what it asks for.
macro_rules! select_drafts {
    ($tail:literal, $argument:expr) => {
        sqlx::query_as!(
            DraftRow,
            r#"SELECT d.id AS "id: Text<EvaluationId>", d.proposal_id AS "proposal: Text<ProposalId>",
                      d.submission_id AS "submission: Text<SubmissionId>", d.team_id AS "team: Text<TeamId>",
                      d.replaces AS "replaces: Text<EvaluationId>", d.run_id AS "run: Text<RunId>",
                      r.state AS "run_state: RunState",
                      r.episodes_per_task * json_array_length(r.tasks) AS "episodes_total!: u32",
                      d.created_at AS "created_at: Instant", d.state, d.finished_at AS "finished_at: Instant",
                      d.reason, d.dataset, d.dataset_blake3, d.result AS "result: Json<EvaluationResult>"
               FROM drafts d JOIN runs r ON r.id = d.run_id "# + $tail,
            $argument
        )
    };
}

/// The draft that becomes this evaluation.
pub(crate) async fn find(connection: &mut SqliteConnection, id: EvaluationId) -> Result<DraftRow> {
    let id = Text(id);
    let found = select_drafts!("WHERE d.id = ?", id).fetch_optional(connection);
    found.await?.ok_or(StoreError::NotFound("evaluation"))
}

/// The drafts of a proposal, in the order in which they were queued.
pub(crate) async fn of_proposal(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<DraftRow>> {
    let proposal = Text(proposal);
    let drafts = select_drafts!(
        "WHERE d.proposal_id = ? ORDER BY d.created_at, d.id",
        proposal
    );
    Ok(drafts.fetch_all(connection).await?)
}

/// The draft that owns a run, if one does, and its proposal.
pub(crate) async fn of_run(
    connection: &mut SqliteConnection,
    run: RunId,
) -> Result<Option<(EvaluationId, ProposalId)>> {
    let run = Text(run);
    let found = sqlx::query!(
        r#"SELECT id AS "id: Text<EvaluationId>", proposal_id AS "proposal: Text<ProposalId>"
           FROM drafts WHERE run_id = ?"#,
        run
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|row| (row.id.0, row.proposal.0)))
}

/// The draft that a unit of work scores, with its run and its proposal.
pub(crate) async fn of_finalisation(
    connection: &mut SqliteConnection,
    unit: Uuid,
) -> Result<Option<(EvaluationId, RunId, ProposalId)>> {
    let unit = Text(unit);
    let found = sqlx::query!(
        r#"SELECT d.id AS "id: Text<EvaluationId>", d.run_id AS "run: Text<RunId>",
                  d.proposal_id AS "proposal: Text<ProposalId>"
           FROM draft_finalisations f JOIN drafts d ON d.id = f.draft_id WHERE f.unit_id = ?"#,
        unit
    )
    .fetch_optional(connection)
    .await?;
    Ok(found.map(|row| (row.id.0, row.run.0, row.proposal.0)))
}

pub(crate) async fn insert(connection: &mut SqliteConnection, new: &Draft) -> Result<()> {
    let (id, proposal, submission) = (Text(new.id), Text(new.proposal), Text(new.submission));
    let (team, replaces, run) = (Text(new.team), new.replaces.map(Text), Text(new.run));
    let created_at = Instant(new.created_at);
    sqlx::query!(
        "INSERT INTO drafts (id, proposal_id, submission_id, team_id, replaces, run_id, created_at, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, 'open')",
        id,
        proposal,
        submission,
        team,
        replaces,
        run,
        created_at,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Has a unit of work score a draft.
pub(crate) async fn insert_finalisation(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    unit: Uuid,
) -> Result<()> {
    let (id, unit) = (Text(id), Text(unit));
    sqlx::query!(
        "INSERT INTO draft_finalisations (draft_id, unit_id) VALUES (?, ?)",
        id,
        unit
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The unit of work that scores a draft, or did, if it came to that.
pub(crate) async fn finalisation_of(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<Option<Uuid>> {
    let id = Text(id);
    let unit = sqlx::query_scalar!(
        r#"SELECT unit_id AS "id: Text<Uuid>" FROM draft_finalisations WHERE draft_id = ?"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(unit.map(|id| id.0))
}

pub(crate) async fn set_finished(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    result: &EvaluationResult,
    dataset: &str,
    dataset_blake3: &str,
    now: Timestamp,
) -> Result<()> {
    let (id, result, now) = (Text(id), Json(result), Instant(now));
    sqlx::query!(
        "UPDATE drafts SET state = 'finished', finished_at = ?, result = ?, dataset = ?, dataset_blake3 = ?
         WHERE id = ?",
        now,
        result,
        dataset,
        dataset_blake3,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

pub(crate) async fn set_failed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    failure: Failure<'_>,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    let (state, reason) = match failure {
        Failure::Agent => ("agent_failed", None),
        Failure::Platform(reason) => ("platform_failed", Some(reason)),
        Failure::Cancelled(reason) | Failure::NotPlayed(reason) => ("cancelled", Some(reason)),
    };
    sqlx::query!(
        "UPDATE drafts SET state = ?, finished_at = ?, reason = ? WHERE id = ?",
        state,
        now,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// How many are not over, of one proposal or of all.
pub(crate) async fn count_open(
    connection: &mut SqliteConnection,
    proposal: Option<ProposalId>,
) -> Result<u32> {
    let proposal = proposal.map(Text);
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM drafts
           WHERE state = 'open' AND (?1 IS NULL OR proposal_id = ?1)"#,
        proposal
    )
    .fetch_one(connection)
    .await?)
}

/// The drafts whose datasets are kept although since `before` nobody will apply them.
pub(crate) async fn with_dropped_datasets(
    connection: &mut SqliteConnection,
    before: Timestamp,
) -> Result<Vec<(EvaluationId, String)>> {
    let before = Instant(before);
    let rows = sqlx::query!(
        r#"SELECT d.id AS "id: Text<EvaluationId>", d.dataset AS "dataset!"
           FROM proposals p JOIN drafts d ON d.proposal_id = p.id
           WHERE p.outcome = 'dropped' AND p.settled_at <= ? AND d.dataset IS NOT NULL AND d.dataset_removed_at IS NULL"#,
        before
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| (row.id.0, row.dataset))
        .collect())
}

pub(crate) async fn set_dataset_removed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE drafts SET dataset_removed_at = ? WHERE id = ?",
        now,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
