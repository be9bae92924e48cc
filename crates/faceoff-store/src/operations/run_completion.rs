//! Start and end of runs and evaluations. A run plays episodes for its owner: an evaluation or an ablation. When it ends, its owner is scored, finished or failed here; so is an evaluation that ends for another reason.

use crate::{
    error::{Result, StoreError},
    event::{Event, Subject},
    operations::{
        job_purpose, release_day, rerun_evaluation,
        runs::{self, RunOwner},
    },
    queue,
    tables::{
        ablations,
        evaluation_runs::{self, EvaluationRun},
        evaluations::{self, Failure},
        runs as run_rows, scorings,
    },
    write::Tx,
};
use faceoff_types::{AblationId, EvaluationId, ProposalId, RunId};

/// How a run ends.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RunEnd<'a> {
    /// All shards are committed.
    Completed,
    /// More agent faults than its plan allows.
    AgentFailed,
    /// Given up after platform faults, with the reason.
    PlatformFailed(&'a str),
}

/// Marks a run as started when its first shard is claimed.
pub(crate) async fn record_run_start(tx: &mut Tx, run: RunId, owner: RunOwner) -> Result<()> {
    if run_rows::begin(tx, run).await?
        && let Subject::Evaluation(_) = owner.subject()
    {
        tx.record(owner.subject(), Event::EvaluationBegun);
    }
    Ok(())
}

/// Ends a run, and continues with its owner. The scoring of an evaluation is queued after a complete run; an ablation is finished
/// after the last of its runs. Otherwise the owner ends without a result.
pub(crate) async fn end_run(
    tx: &mut Tx,
    run: RunId,
    owner: RunOwner,
    end: RunEnd<'_>,
) -> Result<()> {
    match end {
        RunEnd::Completed => run_rows::set_complete(tx, run).await?,
        RunEnd::AgentFailed | RunEnd::PlatformFailed(_) => runs::stop(tx, run).await?,
    }
    match (owner, end) {
        (RunOwner::Evaluation { id, proposal }, RunEnd::Completed) => {
            queue_scoring(tx, id).await?;
            if proposal.is_none() {
                tx.record(Subject::Evaluation(id), Event::EvaluationScoringStarted);
            }
            Ok(())
        }
        (RunOwner::Evaluation { id, .. }, RunEnd::AgentFailed) => {
            fail_evaluation(tx, id, Failure::Agent).await
        }
        (RunOwner::Evaluation { id, .. }, RunEnd::PlatformFailed(reason)) => {
            fail_evaluation(tx, id, Failure::Platform(reason)).await
        }
        (RunOwner::Ablation(id), RunEnd::Completed) => finish_ablation_if_complete(tx, id).await,
        (RunOwner::Ablation(id), RunEnd::AgentFailed) => {
            let plan = run_rows::find(tx, run).await?.plan;
            let reason = format!(
                "the agent violated the protocol or a limit more than {} times with {}",
                plan.max_faults, plan.profile
            );
            fail_ablation(tx, id, &reason).await
        }
        (RunOwner::Ablation(id), RunEnd::PlatformFailed(reason)) => {
            fail_ablation(tx, id, reason).await
        }
    }
}

async fn queue_scoring(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let account = queue::open_account(
        tx,
        job_purpose::SCORING.lane,
        job_purpose::PLATFORM_ACCOUNT_OWNER,
    )
    .await?;
    let job = queue::insert(tx, job_purpose::SCORING, account).await?;
    scorings::insert(tx, id, job).await
}

/// Ends an evaluation without a score, whether its run was over or not. After a platform fault one that counts is rerun
/// automatically, a bounded number of times.
pub(crate) async fn fail_evaluation(
    tx: &mut Tx,
    id: EvaluationId,
    failure: Failure<'_>,
) -> Result<()> {
    let EvaluationRun { run, proposal, .. } = evaluation_runs::run_of(tx, id).await?;
    runs::stop(tx, run).await?;
    let scoring = scorings::job_of(tx, id).await?;
    queue::drop_jobs(tx, scoring.as_slice()).await?;
    let now = tx.now;
    evaluations::set_failed(tx, id, failure, now).await?;
    if let Some(proposal) = proposal {
        return record_proposal_end(tx, proposal).await;
    }
    let event = match failure {
        Failure::Agent => Event::EvaluationAgentFailed,
        Failure::Platform(reason) => Event::EvaluationPlatformFailed {
            reason: reason.to_owned(),
        },
        Failure::Cancelled(reason) => Event::EvaluationCancelled {
            reason: reason.to_owned(),
        },
        Failure::DeadlineMissed(reason) => Event::EvaluationDeadlineMissed {
            reason: reason.to_owned(),
        },
    };
    tx.record(Subject::Evaluation(id), event);
    if let Failure::Platform(_) = failure {
        log_damage(
            id,
            rerun_evaluation::rerun_after_platform_fault(tx, id).await,
        )?;
    }
    log_damage(id, release_day::release_if_over(tx, id).await)
}

/// Records the end of a proposal once all its evaluations have ended.
pub(crate) async fn record_proposal_end(tx: &mut Tx, proposal: ProposalId) -> Result<()> {
    if evaluations::count_open_proposed(tx, Some(proposal)).await? == 0 {
        tx.record(Subject::Proposal(proposal), Event::ProposalPlayed);
    }
    Ok(())
}

/// Logs damaged rows instead of failing. A damaged evaluation is not rerun and releases no day, but it must
/// end: it would block the queue otherwise.
fn log_damage(id: EvaluationId, outcome: Result<()>) -> Result<()> {
    match outcome {
        Err(StoreError::Damaged(defect)) => {
            tracing::error!(evaluation = %id, defect, "ended a damaged evaluation");
            Ok(())
        }
        outcome => outcome,
    }
}

async fn finish_ablation_if_complete(tx: &mut Tx, id: AblationId) -> Result<()> {
    if ablations::all_complete(tx, id).await? {
        let now = tx.now;
        ablations::set_ended(tx, id, None, now).await?;
        tx.record(Subject::Ablation(id), Event::AblationFinished);
    }
    Ok(())
}

async fn fail_ablation(tx: &mut Tx, id: AblationId, reason: &str) -> Result<()> {
    for run in ablations::runs(tx, id).await? {
        runs::stop(tx, run).await?;
    }
    let now = tx.now;
    ablations::set_ended(tx, id, Some(reason), now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Ablation(id), Event::AblationFailed { reason });
    Ok(())
}
