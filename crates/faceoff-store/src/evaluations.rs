use crate::{
    EvaluationPlan, Event, Store, StoreError, Submission, SubmissionState,
    column::{Instant, Json},
    releases, season, shards, submissions,
};
use faceoff_types::{
    AgentFault, EvaluationId, EvaluationResult, Profile, SubmissionId, Task, TeamId,
};
use jiff::{Timestamp, civil::Date, tz::TimeZone};
use sqlx::{SqliteConnection, types::Text};

/// One run of a submission over the tasks of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Its id.
    pub id: EvaluationId,
    /// What is evaluated.
    pub submission: SubmissionId,
    /// Whose turn it takes.
    pub team: TeamId,
    /// The UTC day whose turn and seed it takes.
    pub day: Date,
    /// What it plays.
    pub plan: EvaluationPlan,
    /// When it was queued.
    pub created_at: Timestamp,
    /// How far it is.
    pub state: EvaluationState,
}

/// An evaluation's way from the queue to the board.
#[derive(Debug, Clone, PartialEq)]
pub enum EvaluationState {
    /// No shard was begun.
    Queued,
    /// Shards are played.
    Running {
        /// Episodes played, as far as the workers have told.
        episodes_done: u32,
        /// Episodes of the plan.
        episodes_total: u32,
    },
    /// All shards are in, the score is being computed.
    Finalising,
    /// Scored.
    Finished {
        /// When.
        finished_at: Timestamp,
        /// The score.
        result: Box<EvaluationResult>,
        /// Artifact key of the dataset archive.
        dataset: String,
    },
    /// Too many agent faults; no score.
    AgentFailed {
        /// When.
        finished_at: Timestamp,
        /// Every fault of the shards that were committed, in order of play.
        faults: Vec<AgentFault>,
        /// The agent's standard error in the shards with faults, the last 64 KiB.
        log: String,
    },
    /// Our fault; the day's turn was given back.
    PlatformFailed {
        /// When.
        finished_at: Timestamp,
        /// What went wrong.
        reason: String,
    },
    /// Stopped by an organiser; the day's turn was given back.
    Cancelled {
        /// When.
        finished_at: Timestamp,
        /// Why.
        reason: String,
    },
}

impl EvaluationState {
    /// Has it come to an end, whichever?
    #[must_use]
    pub const fn is_over(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running { .. } | Self::Finalising)
    }

    /// Does it use up its team's turn of the day?
    #[must_use]
    pub const fn takes_turn(&self) -> bool {
        !matches!(self, Self::PlatformFailed { .. } | Self::Cancelled { .. })
    }
}

struct EvaluationRow {
    id: Text<EvaluationId>,
    submission_id: Text<SubmissionId>,
    team_id: Text<TeamId>,
    day: Text<Date>,
    profile: Text<Profile>,
    tasks: Json<Vec<Task>>,
    episodes_per_task: u32,
    episodes_per_shard: u32,
    max_faults: u32,
    created_at: Instant,
    state: String,
    finished_at: Option<Instant>,
    result: Option<Json<EvaluationResult>>,
    dataset: Option<String>,
    faults: Option<Json<Vec<AgentFault>>>,
    log: Option<String>,
    reason: Option<String>,
    episodes_done: u32,
}

impl TryFrom<EvaluationRow> for Evaluation {
    type Error = StoreError;

    fn try_from(row: EvaluationRow) -> Result<Self, StoreError> {
        let id = row.id.0;
        let missing = |what: &str| {
            StoreError::Damaged(format!("evaluation {id}: {} without {what}", row.state))
        };
        let plan = EvaluationPlan {
            profile: row.profile.0,
            tasks: row.tasks.0,
            episodes_per_task: row.episodes_per_task,
            episodes_per_shard: row.episodes_per_shard,
            max_faults: row.max_faults,
        };
        let finished_at = || {
            row.finished_at
                .map(|at| at.0)
                .ok_or_else(|| missing("an end"))
        };
        let reason = || row.reason.clone().ok_or_else(|| missing("a reason"));
        let episodes_total = plan.episodes_total();
        let state = match row.state.as_str() {
            "queued" => EvaluationState::Queued,
            "running" => EvaluationState::Running {
                episodes_done: row.episodes_done.min(episodes_total),
                episodes_total,
            },
            "finalising" => EvaluationState::Finalising,
            "finished" => EvaluationState::Finished {
                finished_at: finished_at()?,
                result: Box::new(row.result.ok_or_else(|| missing("a result"))?.0),
                dataset: row.dataset.ok_or_else(|| missing("a dataset"))?,
            },
            "agent_failed" => EvaluationState::AgentFailed {
                finished_at: finished_at()?,
                faults: row.faults.ok_or_else(|| missing("faults"))?.0,
                log: row.log.ok_or_else(|| missing("a log"))?,
            },
            "platform_failed" => EvaluationState::PlatformFailed {
                finished_at: finished_at()?,
                reason: reason()?,
            },
            "cancelled" => EvaluationState::Cancelled {
                finished_at: finished_at()?,
                reason: reason()?,
            },
            _ => return Err(missing("a known state")),
        };
        Ok(Self {
            id,
            submission: row.submission_id.0,
            team: row.team_id.0,
            day: row.day.0,
            plan,
            created_at: row.created_at.0,
            state,
        })
    }
}

/// `SELECT` of whole evaluations `e`; the argument is what follows `FROM evaluations e`.
macro_rules! select_evaluations {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            EvaluationRow,
            r#"SELECT e.id AS "id: Text<EvaluationId>",
                      e.submission_id AS "submission_id: Text<SubmissionId>",
                      e.team_id AS "team_id: Text<TeamId>", e.day AS "day: Text<Date>",
                      e.profile AS "profile: Text<Profile>", e.tasks AS "tasks: Json<Vec<Task>>",
                      e.episodes_per_task AS "episodes_per_task: u32",
                      e.episodes_per_shard AS "episodes_per_shard: u32",
                      e.max_faults AS "max_faults: u32",
                      e.created_at AS "created_at: Instant", e.state,
                      e.finished_at AS "finished_at: Instant",
                      e.result AS "result: Json<EvaluationResult>", e.dataset,
                      e.faults AS "faults: Json<Vec<AgentFault>>", e.log, e.reason,
                      (SELECT COALESCE(SUM(u.episodes_done), 0) FROM work_units u
                       WHERE u.evaluation_id = e.id AND u.kind = 'shard') AS "episodes_done!: u32"
               FROM evaluations e "# + $tail
            $(, $argument)*
        )
    };
}

/// Reads one evaluation.
pub(crate) async fn find(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<Evaluation, StoreError> {
    let id = Text(id);
    select_evaluations!("WHERE e.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("evaluation"))?
        .try_into()
}

/// The finished evaluation of each team's newest such day, in no particular order.
pub(crate) async fn newest_finished(
    connection: &mut SqliteConnection,
) -> Result<Vec<Evaluation>, StoreError> {
    select_evaluations!(
        "WHERE e.state = 'finished' AND NOT EXISTS (
                 SELECT 1 FROM evaluations n
                 WHERE n.team_id = e.team_id AND n.state = 'finished' AND n.day > e.day)"
    )
    .fetch_all(connection)
    .await?
    .into_iter()
    .map(Evaluation::try_from)
    .collect()
}

/// Takes the turn of `day` and queues the shards.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    submission: &Submission,
    plan: &EvaluationPlan,
    day: Date,
    now: Timestamp,
) -> Result<Evaluation, StoreError> {
    let id = EvaluationId::new();
    {
        let (id, submission_id, team) = (Text(id), Text(submission.id), Text(submission.team));
        let (day_text, profile, tasks) = (Text(day), Text(plan.profile), Json(&plan.tasks));
        let now = Instant(now);
        sqlx::query!(
            "INSERT INTO evaluations (id, submission_id, team_id, day, profile, tasks,
                 episodes_per_task, episodes_per_shard, max_faults, created_at, state)
             VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'queued')",
            id,
            submission_id,
            team,
            day_text,
            profile,
            tasks,
            plan.episodes_per_task,
            plan.episodes_per_shard,
            plan.max_faults,
            now,
        )
        .execute(&mut *connection)
        .await
        .map_err(|error| match day.tomorrow() {
            Ok(next) if StoreError::is_duplicate(&error, "evaluations.day") => {
                StoreError::AlreadyEvaluated { day, next }
            }
            _ => error.into(),
        })?;
    }
    shards::insert(connection, id, submission.id, plan, now).await?;
    find(connection, id).await
}

/// The UTC day of an instant.
pub(crate) fn utc_day(now: Timestamp) -> Date {
    now.to_zoned(TimeZone::UTC).date()
}

/// Starts every team that has a valid submission and has not used its turn of `now`'s day.
pub(crate) async fn start_teams(
    connection: &mut SqliteConnection,
    plan: &EvaluationPlan,
    now: Timestamp,
) -> Result<Vec<Evaluation>, StoreError> {
    plan.check()?;
    season::check_open(connection).await?;
    let day = utc_day(now);
    let released_at = releases::released_at(connection, day).await?;
    let mut started = Vec::new();
    for submission in submissions::awaiting_turn(connection, day, released_at).await? {
        started.push(insert(connection, &submission, plan, day, now).await?);
    }
    Ok(started)
}

impl Store {
    /// Queues an evaluation of a valid submission, taking its team's turn of `now`'s UTC day.
    /// [`StoreError::AlreadyEvaluated`] if the turn is used, [`StoreError::DayReleased`] if the
    /// submission came after the release of the day's seed, [`StoreError::SeasonClosed`] once the
    /// season is over, [`StoreError::Conflict`] if the submission is not valid (yet) or the plan is
    /// empty.
    pub async fn create_evaluation(
        &self,
        submission: SubmissionId,
        plan: &EvaluationPlan,
        now: Timestamp,
    ) -> Result<Evaluation, StoreError> {
        plan.check()?;
        let mut tx = self.database.begin().await?;
        season::check_open(&mut tx).await?;
        let submission = submissions::find(&mut tx, submission).await?;
        match &submission.state {
            SubmissionState::Valid { .. } => {}
            SubmissionState::Validating { .. } => {
                return Err(StoreError::Conflict(
                    "the submission's smoke run is not over: wait until it is valid".into(),
                ));
            }
            SubmissionState::Invalid { reason, .. } => {
                return Err(StoreError::Conflict(format!(
                    "the submission is invalid ({reason}): upload a corrected one"
                )));
            }
            SubmissionState::ValidationError { .. } => {
                return Err(StoreError::Conflict(
                    "the submission could not be checked, by our fault: upload it again".into(),
                ));
            }
        }
        let day = utc_day(now);
        let evaluation = insert(&mut tx, &submission, plan, day, now).await?;
        // after the insertion: that the turn is used says more
        if let Some(released_at) = releases::released_at(&mut tx, day).await?
            && submission.created_at >= released_at
            && let Ok(next) = day.tomorrow()
        {
            return Err(StoreError::DayReleased {
                day,
                released_at,
                next,
            });
        }
        tx.commit().await?;
        self.signals.work_added();
        self.signals.changed(Event::Evaluation(evaluation.id));
        Ok(evaluation)
    }

    /// The evaluation with this id.
    pub async fn evaluation(&self, id: EvaluationId) -> Result<Evaluation, StoreError> {
        find(&mut *self.database.read.acquire().await?, id).await
    }

    /// A team's evaluations, newest first.
    pub async fn evaluations_of(&self, team: TeamId) -> Result<Vec<Evaluation>, StoreError> {
        let team = Text(team);
        select_evaluations!(
            "WHERE e.team_id = ? ORDER BY e.created_at DESC, e.id DESC",
            team
        )
        .fetch_all(&self.database.read)
        .await?
        .into_iter()
        .map(Evaluation::try_from)
        .collect()
    }

    /// The evaluations of a UTC day, in the order in which they were queued.
    pub async fn evaluations_on(&self, day: Date) -> Result<Vec<Evaluation>, StoreError> {
        let day = Text(day);
        select_evaluations!("WHERE e.day = ? ORDER BY e.created_at, e.id", day)
            .fetch_all(&self.database.read)
            .await?
            .into_iter()
            .map(Evaluation::try_from)
            .collect()
    }

    /// Starts the day: queues an evaluation of the newest valid submission of each team that has not
    /// used its turn of `now`'s UTC day, earliest submission first; once the day's seed is released,
    /// of those uploaded before. Returns what was created. [`StoreError::SeasonClosed`] once the
    /// season is over.
    pub async fn start_day(
        &self,
        plan: &EvaluationPlan,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>, StoreError> {
        let mut tx = self.database.begin().await?;
        let started = start_teams(&mut tx, plan, now).await?;
        tx.commit().await?;
        self.announce(&started);
        Ok(started)
    }

    /// Tells workers and pages of evaluations whose transaction is committed.
    pub(crate) fn announce(&self, started: &[Evaluation]) {
        if !started.is_empty() {
            self.signals.work_added();
        }
        for evaluation in started {
            self.signals.changed(Event::Evaluation(evaluation.id));
        }
    }
}
