use crate::{
    AblationRun, Claim, Evaluation, Event, Shard, Store, StoreError, Submission, ablations,
    column::Instant, evaluation_ends, evaluations, leases, shards, smoke_runs, submissions,
};
use faceoff_types::{AblationRunId, BundleRef, EvaluationId, ShardId, SubmissionId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Failures of ours after which a unit of work is given up.
pub const MAX_ATTEMPTS: u32 = 5;

/// Leases of one unit after which it is given up although no worker reported a failure: something in
/// it kills its worker. Far above [`MAX_ATTEMPTS`], since a server that is killed again and again for
/// other reasons must not cost a team its evaluation.
pub const MAX_LEASES: u32 = 50;

/// A claimed unit of work.
#[derive(Debug, Clone)]
pub enum Work {
    /// Check that an uploaded bundle starts, answers and keeps time.
    Smoke {
        /// Proof of the lease.
        claim: Claim,
        /// What to check.
        submission: Submission,
    },
    /// Play a range of episodes.
    Shard {
        /// Proof of the lease.
        claim: Claim,
        /// The evaluation it belongs to.
        evaluation: Evaluation,
        /// The range.
        shard: Shard,
        /// The agent.
        bundle: BundleRef,
    },
    /// Join the recordings of an evaluation whose shards are all committed, and score it.
    Finalise {
        /// Proof of the lease.
        claim: Claim,
        /// The evaluation.
        evaluation: Evaluation,
        /// The agent's own name.
        agent_name: String,
    },
    /// Play one task of an ablation under one profile.
    Ablation {
        /// Proof of the lease.
        claim: Claim,
        /// What to play.
        run: AblationRun,
        /// The agent.
        bundle: BundleRef,
    },
}

impl Work {
    /// Proof of the lease.
    #[must_use]
    pub const fn claim(&self) -> &Claim {
        match self {
            Self::Smoke { claim, .. }
            | Self::Shard { claim, .. }
            | Self::Finalise { claim, .. }
            | Self::Ablation { claim, .. } => claim,
        }
    }
}

struct Leased {
    id: Text<Uuid>,
    kind: String,
    submission: Text<SubmissionId>,
    evaluation: Option<Text<EvaluationId>>,
    shard: Option<Text<ShardId>>,
    ablation_run: Option<Text<AblationRunId>>,
    attempts: u32,
}

impl Leased {
    fn missing(&self, what: &str) -> StoreError {
        StoreError::Damaged(format!(
            "work unit {}: {} without {what}",
            self.id.0, self.kind
        ))
    }

    fn evaluation(&self) -> Result<EvaluationId, StoreError> {
        self.evaluation
            .map(|id| id.0)
            .ok_or_else(|| self.missing("an evaluation"))
    }
}

/// Queues the finalisation of an evaluation whose last shard was committed.
pub(crate) async fn insert_finalise(
    connection: &mut SqliteConnection,
    evaluation: EvaluationId,
    submission: SubmissionId,
    now: Timestamp,
) -> Result<(), StoreError> {
    let (id, evaluation, submission) = (Text(Uuid::now_v7()), Text(evaluation), Text(submission));
    let now = Instant(now);
    sqlx::query!(
        "UPDATE evaluations SET state = 'finalising' WHERE id = ?",
        evaluation
    )
    .execute(&mut *connection)
    .await?;
    sqlx::query!(
        "INSERT INTO work_units (id, kind, submission_id, evaluation_id, state, claimable_at)
         VALUES (?, 'finalise', ?, ?, 'queued', ?)",
        id,
        submission,
        evaluation,
        now,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// What a unit belongs to.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Owner {
    Evaluation(EvaluationId),
    Ablation(AblationRunId),
    /// Its smoke run.
    Submission(SubmissionId),
}

impl Owner {
    pub(crate) fn of(
        evaluation: Option<EvaluationId>,
        ablation_run: Option<AblationRunId>,
        submission: SubmissionId,
    ) -> Self {
        match (evaluation, ablation_run) {
            (Some(id), _) => Self::Evaluation(id),
            (None, Some(run)) => Self::Ablation(run),
            (None, None) => Self::Submission(submission),
        }
    }
}

/// Ends what a unit belongs to by our fault.
pub(crate) async fn give_up(
    connection: &mut SqliteConnection,
    unit: Uuid,
    owner: Owner,
    reason: &str,
    now: Timestamp,
) -> Result<(), StoreError> {
    match owner {
        Owner::Evaluation(id) => evaluation_ends::fail_platform(connection, id, reason, now).await,
        Owner::Ablation(run) => ablations::fail(connection, run, reason, now).await,
        Owner::Submission(id) => smoke_runs::give_up(connection, unit, id, reason).await,
    }
}

impl Store {
    /// Leases the next unit of work for `lease_s` seconds: smoke runs first, then finalisations, then
    /// shards in evaluation order, then runs of ablations. A unit whose lease is over is leased again. `None`: nothing to do
    /// now (see [`Store::work_signal`]).
    pub async fn claim(
        &self,
        worker: &str,
        lease_s: u32,
        now: Timestamp,
    ) -> Result<Option<Work>, StoreError> {
        let nonce = Uuid::now_v7();
        let mut given_up = Vec::new();
        let mut tx = self.database.begin().await?;
        let work = loop {
            let Some(unit) = lease_next(&mut tx, worker, nonce, lease_s, now).await? else {
                break None;
            };
            let reason = if unit.attempts > MAX_LEASES {
                format!("{MAX_LEASES} workers died over it")
            } else {
                let lease_until = leases::after(now, lease_s).0;
                let claim = Claim {
                    unit: unit.id.0,
                    nonce,
                    lease_until,
                };
                match describe(&mut tx, claim, &unit).await {
                    Ok(work) => break Some(work),
                    // Given up rather than returned: it would be the next claim's unit again, and
                    // nobody else's work would ever be done.
                    Err(StoreError::Damaged(what)) => {
                        tracing::error!(unit = %unit.id.0, what, "damaged work is given up");
                        "a stored value is damaged".to_owned()
                    }
                    Err(error) => return Err(error),
                }
            };
            let evaluation = unit.evaluation.map(|id| id.0);
            let run = unit.ablation_run.map(|id| id.0);
            let owner = Owner::of(evaluation, run, unit.submission.0);
            give_up(&mut tx, unit.id.0, owner, &reason, now).await?;
            given_up
                .push(evaluation.map_or(Event::Submission(unit.submission.0), Event::Evaluation));
        };
        tx.commit().await?;
        for event in given_up {
            self.signals.changed(event);
        }
        match &work {
            Some(Work::Smoke { submission, .. }) => {
                self.signals.changed(Event::Submission(submission.id));
            }
            Some(Work::Shard { evaluation, .. } | Work::Finalise { evaluation, .. }) => {
                self.signals.changed(Event::Evaluation(evaluation.id));
            }
            Some(Work::Ablation { .. }) | None => {}
        }
        Ok(work)
    }
}

/// The claim itself: one statement.
async fn lease_next(
    connection: &mut SqliteConnection,
    worker: &str,
    nonce: Uuid,
    lease_s: u32,
    now: Timestamp,
) -> Result<Option<Leased>, StoreError> {
    let (nonce, until, now) = (Text(nonce), leases::after(now, lease_s), Instant(now));
    Ok(sqlx::query_as!(
        Leased,
        r#"UPDATE work_units
           SET state = 'leased', worker = ?, nonce = ?, claimable_at = ?, attempts = attempts + 1,
               episodes_done = 0
           WHERE queue_no = (SELECT queue_no FROM work_units
                             WHERE state IN ('queued', 'leased') AND claimable_at <= ?
                             ORDER BY urgency, queue_no LIMIT 1)
           RETURNING id AS "id!: Text<Uuid>", kind AS "kind!",
                     submission_id AS "submission!: Text<SubmissionId>",
                     evaluation_id AS "evaluation?: Text<EvaluationId>",
                     shard_id AS "shard?: Text<ShardId>",
                     ablation_run_id AS "ablation_run?: Text<AblationRunId>",
                     attempts AS "attempts!: u32""#,
        worker,
        nonce,
        until,
        now,
    )
    .fetch_optional(connection)
    .await?)
}

/// Reads what the leased unit is about.
async fn describe(
    connection: &mut SqliteConnection,
    claim: Claim,
    unit: &Leased,
) -> Result<Work, StoreError> {
    let submission = submissions::find(connection, unit.submission.0).await?;
    match unit.kind.as_str() {
        "smoke" => Ok(Work::Smoke { claim, submission }),
        "shard" => {
            let id = unit.evaluation()?;
            begin_evaluation(connection, id).await?;
            let shard = unit.shard.ok_or_else(|| unit.missing("a shard"))?.0;
            Ok(Work::Shard {
                claim,
                evaluation: evaluations::find(connection, id).await?,
                shard: shards::find(connection, shard).await?,
                bundle: submission.bundle,
            })
        }
        "finalise" => Ok(Work::Finalise {
            claim,
            evaluation: evaluations::find(connection, unit.evaluation()?).await?,
            agent_name: submission
                .agent_name
                .ok_or_else(|| unit.missing("an agent's name"))?,
        }),
        "ablation" => {
            let run = unit.ablation_run.ok_or_else(|| unit.missing("a run"))?.0;
            Ok(Work::Ablation {
                claim,
                run: ablations::find_run(connection, run).await?,
                bundle: submission.bundle,
            })
        }
        _ => Err(unit.missing("a known kind")),
    }
}

/// An evaluation runs from its first claimed shard on.
async fn begin_evaluation(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<(), StoreError> {
    let id = Text(id);
    sqlx::query!(
        "UPDATE evaluations SET state = 'running' WHERE id = ? AND state = 'queued'",
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
