//! The table of evaluations: their state from the queue to the result. It holds those of days, which count, and those of
//! proposals (trials and proposed re-evaluations), which do not. The view `counting_evaluations` has the former only, also if
//! they are open, failed or voided.

use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
    tables::{
        decision_records::DecisionRecord, run_plan::RunPlan, run_progress::RunProgress,
        runs::RunState,
    },
};
use faceoff_types::{
    EvaluationId, EvaluationResult, Profile, ProposalId, RunId, StageDay, StageId, StageLimits,
    SubmissionId, Task, TeamId, Variation,
};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// An evaluation: a team's run of all tasks on an evaluation day.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Part of its URLs.
    pub id: EvaluationId,
    pub submission: SubmissionId,
    pub team: TeamId,
    /// Stage and date of the day; its seed derives from them.
    pub stage_day: StageDay,
    /// Revision of the stage's rules; a board shows one revision only.
    pub revision: u32,
    /// When the day was released; `None` while its episodes are secret.
    pub released_at: Option<Timestamp>,
    /// Deadline of the day; `None`: there is none.
    pub deadline_at: Option<Timestamp>,
    /// The earlier evaluation that it repeats after a platform fault or a cancellation.
    pub rerun_of: Option<EvaluationId>,
    pub run: RunId,
    pub plan: RunPlan,
    /// When it was queued.
    pub created_at: Timestamp,
    /// The reason of an extra evaluation; `None` for the team's regular evaluation of the day.
    pub extra_reason: Option<String>,
    /// Set if it was voided and does not count.
    pub voided: Option<DecisionRecord>,
    /// When its team published its dataset.
    pub published_at: Option<Timestamp>,
    /// Set if its dataset was removed; the reason names the retention.
    pub dataset_removed: Option<DecisionRecord>,
    pub state: EvaluationState,
}

/// An evaluation of a proposal: a trial, or a re-evaluation until the proposal is applied. It does not count.
#[derive(Debug, Clone, PartialEq)]
pub struct ProposedEvaluation {
    /// It keeps its id when it is applied.
    pub id: EvaluationId,
    pub submission: SubmissionId,
    pub team: TeamId,
    /// The evaluation that it repeats; `None` in a trial.
    pub replaces: Option<EvaluationId>,
    pub run: RunId,
    /// When it was queued.
    pub created_at: Timestamp,
    pub state: EvaluationState,
}

/// The purpose of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, sqlx::Type)]
#[sqlx(rename_all = "snake_case")]
pub(crate) enum EvaluationPurpose {
    /// It is a team's evaluation of a day.
    Counting,
    /// It has episodes of its own and never counts.
    Trial,
    /// It repeats an evaluation of a day, and counts once its proposal is applied.
    Reevaluation,
}

/// State of an evaluation, from the queue to its result.
#[derive(Debug, Clone, PartialEq)]
pub enum EvaluationState {
    /// No shard has started.
    Queued,
    Running {
        progress: RunProgress,
        episodes_total: u32,
    },
    /// All shards are committed, the score is being computed.
    Scoring,
    Finished {
        /// When score and dataset were stored.
        finished_at: Timestamp,
        result: Box<EvaluationResult>,
        /// Artifact key of the dataset archive.
        dataset: String,
        /// BLAKE3 of the archive, 64 hexadecimal digits; `None` for datasets of older versions.
        dataset_blake3: Option<String>,
    },
    /// Ended without a score after too many agent faults. [`Store::run_faults`](crate::Store::run_faults) reads the
    /// faults and the log.
    AgentFailed {
        /// When the fault that exceeded the limit was committed.
        finished_at: Timestamp,
    },
    /// Ended without a score after platform faults; an organiser may repeat it.
    PlatformFailed {
        /// When it was given up.
        finished_at: Timestamp,
        reason: String,
    },
    /// Incomplete at its day's deadline, for lack of server capacity.
    DeadlineMissed {
        finished_at: Timestamp,
        /// Shown to the team.
        reason: String,
    },
    /// Cancelled by an organiser, who may repeat it.
    Cancelled {
        finished_at: Timestamp,
        /// Shown to the team.
        reason: String,
    },
}

impl EvaluationState {
    /// Has the evaluation ended, with or without a result?
    #[must_use]
    pub const fn is_over(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running { .. } | Self::Scoring)
    }
}

/// An evaluation with its run, without the run's progress.
pub(crate) struct EvaluationRow {
    id: EvaluationId,
    submission_id: SubmissionId,
    team_id: TeamId,
    stage_id: StageId,
    /// The proposal that created it, if one did.
    proposal_id: Option<ProposalId>,
    /// `None` for a trial.
    day: Option<Text<Date>>,
    revision: u32,
    released_at: Option<Instant>,
    deadline_at: Option<Instant>,
    rerun_of: Option<EvaluationId>,
    run_id: RunId,
    profile: Profile,
    tasks: Json<Vec<Task>>,
    episodes_per_task: u32,
    episodes_per_shard: u32,
    max_faults: u32,
    variation: Option<Json<Variation>>,
    limits: Option<Json<Box<StageLimits>>>,
    run_state: RunState,
    created_at: Instant,
    state: String,
    finished_at: Option<Instant>,
    result: Option<Json<EvaluationResult>>,
    dataset: Option<String>,
    dataset_blake3: Option<String>,
    reason: Option<String>,
    /// Was it cancelled because its day's deadline passed?
    unplayed: bool,
    /// The reason of an extra evaluation.
    extra_for: Option<String>,
    voided_at: Option<Instant>,
    voided_for: Option<String>,
    published_at: Option<Instant>,
    dataset_removed_at: Option<Instant>,
    dataset_removed_for: Option<String>,
}

impl EvaluationRow {
    /// The run, if it is running: its progress is part of the evaluation's state.
    pub(crate) fn open_run(&self) -> Option<RunId> {
        (self.state == "open" && self.run_state == RunState::Running).then_some(self.run_id)
    }

    /// The proposal that created the evaluation.
    pub(crate) fn proposal(&self) -> Result<ProposalId> {
        self.proposal_id
            .ok_or_else(|| self.damaged("without a proposal"))
    }

    fn damaged(&self, problem: &str) -> StoreError {
        StoreError::Damaged(format!("evaluation {}: {} {problem}", self.id, self.state))
    }

    fn take_plan(&mut self) -> RunPlan {
        RunPlan {
            profile: self.profile,
            tasks: std::mem::take(&mut self.tasks.0),
            episodes_per_task: self.episodes_per_task,
            episodes_per_shard: self.episodes_per_shard,
            max_faults: self.max_faults,
            variation: self
                .variation
                .take()
                .map(|variation| variation.0)
                .unwrap_or_default(),
            limits: self
                .limits
                .take()
                .map(|limits| limits.0)
                .unwrap_or_default(),
        }
    }

    fn take_state(
        &mut self,
        progress: RunProgress,
        episodes_total: u32,
    ) -> Result<EvaluationState> {
        let finished_at = || {
            self.finished_at
                .map(|at| at.0)
                .ok_or_else(|| self.damaged("without an end"))
        };
        let reason = || {
            self.reason
                .clone()
                .ok_or_else(|| self.damaged("without a reason"))
        };
        Ok(match (self.state.as_str(), self.run_state) {
            ("open", RunState::Queued) => EvaluationState::Queued,
            ("open", RunState::Running) => EvaluationState::Running {
                progress,
                episodes_total,
            },
            ("open", RunState::Complete) => EvaluationState::Scoring,
            ("finished", _) => EvaluationState::Finished {
                finished_at: finished_at()?,
                result: match self.result.take() {
                    Some(result) => Box::new(result.0),
                    None => return Err(self.damaged("without a result")),
                },
                dataset: match self.dataset.take() {
                    Some(dataset) => dataset,
                    None => return Err(self.damaged("without a dataset")),
                },
                dataset_blake3: self.dataset_blake3.take(),
            },
            ("agent_failed", _) => EvaluationState::AgentFailed {
                finished_at: finished_at()?,
            },
            ("platform_failed", _) => EvaluationState::PlatformFailed {
                finished_at: finished_at()?,
                reason: reason()?,
            },
            ("cancelled", _) if self.unplayed => EvaluationState::DeadlineMissed {
                finished_at: finished_at()?,
                reason: reason()?,
            },
            ("cancelled", _) => EvaluationState::Cancelled {
                finished_at: finished_at()?,
                reason: reason()?,
            },
            (_, run) => return Err(self.damaged(&format!("with a run that is {run:?}"))),
        })
    }

    /// For a row of a proposal.
    pub(crate) fn into_proposed(mut self, progress: RunProgress) -> Result<ProposedEvaluation> {
        let episodes_total = self.take_plan().episodes_total();
        let state = self.take_state(progress, episodes_total)?;
        Ok(ProposedEvaluation {
            id: self.id,
            submission: self.submission_id,
            team: self.team_id,
            replaces: self.rerun_of,
            run: self.run_id,
            created_at: self.created_at.0,
            state,
        })
    }

    /// For a row of `counting_evaluations`: an evaluation of a day, also a voided one.
    pub(crate) fn into_evaluation(mut self, progress: RunProgress) -> Result<Evaluation> {
        let plan = self.take_plan();
        let state = self.take_state(progress, plan.episodes_total())?;
        let Some(day) = self.day else {
            return Err(self.damaged("without a day"));
        };
        Ok(Evaluation {
            id: self.id,
            submission: self.submission_id,
            team: self.team_id,
            stage_day: StageDay {
                stage: self.stage_id,
                date: day.0,
            },
            revision: self.revision,
            released_at: self.released_at.map(|at| at.0),
            deadline_at: self.deadline_at.map(|at| at.0),
            rerun_of: self.rerun_of,
            run: self.run_id,
            plan,
            created_at: self.created_at.0,
            extra_reason: self.extra_for,
            voided: DecisionRecord::from_columns(self.voided_at, self.voided_for),
            published_at: self.published_at.map(|at| at.0),
            dataset_removed: DecisionRecord::from_columns(
                self.dataset_removed_at,
                self.dataset_removed_for,
            ),
            state,
        })
    }
}

/// `SELECT` of evaluations `e` with their runs `r`; the arguments are the table or view, and the SQL after it.
macro_rules! select_evaluations {
    ($tail:literal $(, $argument:expr)*) => {
        select_evaluations!(from "counting_evaluations", $tail $(, $argument)*)
    };
    (from $table:literal, $tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            EvaluationRow,
            "SELECT e.id, e.proposal_id, e.submission_id, e.team_id, e.stage_id, e.day, e.revision, d.released_at, d.deadline_at,
                    e.rerun_of, e.run_id, r.profile, r.tasks, r.episodes_per_task, r.episodes_per_shard, r.max_faults,
                    r.variation, r.limits, r.state AS run_state, e.created_at, e.state, e.finished_at, e.result,
                    e.dataset, e.dataset_blake3, e.reason, e.unplayed, e.extra_for, e.voided_at, e.voided_for,
                    e.published_at, e.dataset_removed_at, e.dataset_removed_for
             FROM " + $table + " e JOIN runs r ON r.id = e.run_id
             LEFT JOIN days d ON d.stage_id = e.stage_id AND d.day = e.day " + $tail
            $(, $argument)*
        )
    };
}

pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<EvaluationRow> {
    select_evaluations!("WHERE e.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("evaluation"))
}

/// A team's evaluations on all days, also voided ones, the newest first.
pub(crate) async fn of_team(
    connection: &mut SqliteConnection,
    team: TeamId,
) -> Result<Vec<EvaluationRow>> {
    Ok(select_evaluations!(
        "WHERE e.team_id = ? ORDER BY e.created_at DESC, e.id DESC",
        team
    )
    .fetch_all(connection)
    .await?)
}

/// When the evaluation was queued; `None` if the id is unknown.
pub(crate) async fn created_at(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<Option<Timestamp>> {
    let at = sqlx::query_scalar!(
        "SELECT created_at AS at FROM counting_evaluations WHERE id = ?",
        id
    );
    Ok(at.fetch_optional(connection).await?.map(|at| at.0))
}

/// One page of a team's evaluations, on one date or on all dates, the newest first: those that follow the evaluation with
/// this time of queueing and this id.
pub(crate) async fn of_team_after(
    connection: &mut SqliteConnection,
    team: TeamId,
    date: Option<Date>,
    (queued_at, id): (Timestamp, Option<EvaluationId>),
    limit: u32,
) -> Result<Vec<EvaluationRow>> {
    Ok(select_evaluations!(
        "WHERE e.team_id = ?1 AND (?2 IS NULL OR e.day = ?2)
           AND e.created_at <= ?3 AND (e.created_at < ?3 OR ?4 IS NULL OR e.id < ?4)
         ORDER BY e.created_at DESC, e.id DESC LIMIT ?5",
        team,
        date.map(Text),
        Instant(queued_at),
        id,
        limit
    )
    .fetch_all(connection)
    .await?)
}

/// One page of the evaluations of all stages on a date, in the order in which they were queued: those that follow the
/// evaluation with this time of queueing and this id.
pub(crate) async fn on_date_after(
    connection: &mut SqliteConnection,
    date: Date,
    (queued_at, id): (Timestamp, Option<EvaluationId>),
    limit: u32,
) -> Result<Vec<EvaluationRow>> {
    Ok(select_evaluations!(
        "WHERE e.day = ?1 AND e.created_at >= ?2 AND (e.created_at > ?2 OR ?3 IS NULL OR e.id > ?3)
         ORDER BY e.created_at, e.id LIMIT ?4",
        Text(date),
        Instant(queued_at),
        id,
        limit
    )
    .fetch_all(connection)
    .await?)
}

/// The evaluations of a stage on one day, also voided ones, in the order in which they were queued.
pub(crate) async fn of_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
) -> Result<Vec<EvaluationRow>> {
    Ok(select_evaluations!(
        "WHERE e.stage_id = ? AND e.day = ? ORDER BY e.created_at, e.id",
        stage_day.stage,
        Text(stage_day.date)
    )
    .fetch_all(connection)
    .await?)
}

/// The evaluations that a proposal was made of, in the order in which they were queued. Those that it was applied with
/// count.
pub(crate) async fn of_proposal(
    connection: &mut SqliteConnection,
    proposal: ProposalId,
) -> Result<Vec<EvaluationRow>> {
    Ok(select_evaluations!(
        from "evaluations",
        "WHERE e.proposal_id = ? ORDER BY e.created_at, e.id",
        proposal
    )
    .fetch_all(connection)
    .await?)
}

/// An evaluation that does not count.
pub(crate) async fn find_proposed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<EvaluationRow> {
    select_evaluations!(from "evaluations", "WHERE e.id = ? AND e.purpose <> 'counting'", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("evaluation"))
}

/// Number of a team's evaluations on a day that ended by a platform fault.
pub(crate) async fn count_platform_failed(
    connection: &mut SqliteConnection,
    team: TeamId,
    stage_day: StageDay,
) -> Result<usize> {
    let count = sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM counting_evaluations
           WHERE team_id = ? AND stage_id = ? AND day = ? AND state = 'platform_failed'"#,
        team,
        stage_day.stage,
        Text(stage_day.date),
    )
    .fetch_one(connection)
    .await?;
    Ok(usize::try_from(count).unwrap_or(usize::MAX))
}

pub(crate) async fn set_finished(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    result: &EvaluationResult,
    dataset: &str,
    dataset_blake3: &str,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET state = 'finished', finished_at = ?, result = ?, dataset = ?, dataset_blake3 = ?,
                                slot_ms = (SELECT SUM(j.charged_ms) FROM shards s JOIN jobs j ON j.id = s.job_id
                                           WHERE s.run_id = evaluations.run_id)
         WHERE id = ?",
        Instant(now),
        Json(result),
        dataset,
        dataset_blake3,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Why an evaluation ended without a score.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Failure<'a> {
    /// The agent had too many faults.
    Agent,
    /// It was given up after platform faults, with this cause.
    Platform(&'a str),
    /// An organiser cancelled it, for this reason.
    Cancelled(&'a str),
    /// Its day's deadline passed. The text is shown to the team.
    DeadlineMissed(&'a str),
}

pub(crate) async fn set_failed(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    failure: Failure<'_>,
    now: Timestamp,
) -> Result<()> {
    let (state, reason) = match failure {
        Failure::Agent => ("agent_failed", None),
        Failure::Platform(reason) => ("platform_failed", Some(reason)),
        Failure::Cancelled(reason) | Failure::DeadlineMissed(reason) => ("cancelled", Some(reason)),
    };
    let deadline_missed = matches!(failure, Failure::DeadlineMissed(_));
    sqlx::query!(
        "UPDATE evaluations SET state = ?, finished_at = ?, reason = ?, unplayed = ? WHERE id = ?",
        state,
        Instant(now),
        reason,
        deadline_missed,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Number of open evaluations of proposals: of one, or of all.
pub(crate) async fn count_open_proposed(
    connection: &mut SqliteConnection,
    proposal: Option<ProposalId>,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations
           WHERE state = 'open' AND purpose <> 'counting' AND (?1 IS NULL OR proposal_id = ?1)"#,
        proposal
    )
    .fetch_one(connection)
    .await?)
}

/// Number of open evaluations of one day or of all days, without those of proposals.
pub(crate) async fn count_open(
    connection: &mut SqliteConnection,
    stage_day: Option<StageDay>,
) -> Result<u32> {
    let (stage, day) = (
        stage_day.map(|day| day.stage),
        stage_day.map(|day| Text(day.date)),
    );
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM counting_evaluations
           WHERE state = 'open' AND (?1 IS NULL OR stage_id = ?1 AND day = ?2)"#,
        stage,
        day
    )
    .fetch_one(connection)
    .await?)
}
