//! What it means for their owners that runs begin and end, and what else ends an evaluation.

use crate::{
    error::{Result, StoreError},
    event::{Event, Subject},
    operations::{
        drafts, purpose, release_day, rerun,
        runs::{self, RunOwner},
    },
    queue,
    tables::{
        ablations,
        evaluations::{self, Failure},
        finalisations, runs as run_rows,
    },
    write::Tx,
};
use faceoff_types::{AblationId, EvaluationId, RunId};

/// How a run ends.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RunEnd<'a> {
    /// All shards are committed.
    Played,
    /// More agent faults than its plan allows.
    AgentFailed,
    /// Our fault, given up, with what went wrong.
    PlatformFailed(&'a str),
}

/// A shard of the run was claimed.
pub(crate) async fn run_begun(tx: &mut Tx, run: RunId, owner: RunOwner) -> Result<()> {
    if run_rows::begin(tx, run).await?
        && let RunOwner::Evaluation(_) = owner
    {
        tx.record(owner.subject(), Event::EvaluationBegun);
    }
    Ok(())
}

/// Ends a run, and with it what its owner has no more use for.
pub(crate) async fn run_ended(
    tx: &mut Tx,
    run: RunId,
    owner: RunOwner,
    end: RunEnd<'_>,
) -> Result<()> {
    match end {
        RunEnd::Played => run_rows::set_played(tx, run).await?,
        RunEnd::AgentFailed | RunEnd::PlatformFailed(_) => runs::stop(tx, run).await?,
    }
    match (owner, end) {
        (RunOwner::Evaluation(id), RunEnd::Played) => queue_finalisation(tx, id).await,
        (RunOwner::Evaluation(id), RunEnd::AgentFailed) => {
            fail_evaluation(tx, id, run, Failure::Agent).await
        }
        (RunOwner::Evaluation(id), RunEnd::PlatformFailed(reason)) => {
            fail_evaluation(tx, id, run, Failure::Platform(reason)).await
        }
        (RunOwner::Draft { id, .. }, RunEnd::Played) => drafts::queue_finalisation(tx, id).await,
        (RunOwner::Draft { id, proposal }, RunEnd::AgentFailed) => {
            drafts::fail(tx, id, run, proposal, Failure::Agent).await
        }
        (RunOwner::Draft { id, proposal }, RunEnd::PlatformFailed(reason)) => {
            drafts::fail(tx, id, run, proposal, Failure::Platform(reason)).await
        }
        (RunOwner::Ablation(id), RunEnd::Played) => finish_ablation_if_played(tx, id).await,
        (RunOwner::Ablation(id), RunEnd::AgentFailed) => {
            let plan = run_rows::find(tx, run).await?.plan;
            let reason = format!(
                "the agent broke the protocol or a limit more than {} times with {}",
                plan.max_faults, plan.profile
            );
            fail_ablation(tx, id, &reason).await
        }
        (RunOwner::Ablation(id), RunEnd::PlatformFailed(reason)) => {
            fail_ablation(tx, id, reason).await
        }
    }
}

async fn queue_finalisation(tx: &mut Tx, id: EvaluationId) -> Result<()> {
    let account = queue::account(tx, purpose::FINALISE.lane, purpose::PLATFORM).await?;
    let unit = queue::insert(tx, purpose::FINALISE, account).await?;
    finalisations::insert(tx, id, unit).await?;
    tx.record(Subject::Evaluation(id), Event::EvaluationFinalising);
    Ok(())
}

/// Ends an evaluation without a score, whether its run was over or not. What we broke is played again,
/// a bounded number of times.
pub(crate) async fn fail_evaluation(
    tx: &mut Tx,
    id: EvaluationId,
    run: RunId,
    failure: Failure<'_>,
) -> Result<()> {
    runs::stop(tx, run).await?;
    let scoring = finalisations::unit_of(tx, id).await?;
    queue::drop_units(tx, scoring.as_slice()).await?;
    let now = tx.now;
    evaluations::set_failed(tx, id, failure, now).await?;
    let event = match failure {
        Failure::Agent => Event::EvaluationAgentFailed,
        Failure::Platform(reason) => Event::EvaluationPlatformFailed {
            reason: reason.to_owned(),
        },
        Failure::Cancelled(reason) => Event::EvaluationCancelled {
            reason: reason.to_owned(),
        },
        Failure::NotPlayed(reason) => Event::EvaluationNotPlayed {
            reason: reason.to_owned(),
        },
    };
    tx.record(Subject::Evaluation(id), event);
    if let Failure::Platform(_) = failure {
        unless_damaged(id, rerun::after_our_fault(tx, id).await)?;
    }
    unless_damaged(id, release_day::if_over(tx, id).await)
}

/// What is damaged is not played again and ends no day, but it must end: it would hold up the queue.
fn unless_damaged(id: EvaluationId, done: Result<()>) -> Result<()> {
    match done {
        Err(StoreError::Damaged(what)) => {
            tracing::error!(evaluation = %id, what, "a damaged evaluation has ended");
            Ok(())
        }
        done => done,
    }
}

async fn finish_ablation_if_played(tx: &mut Tx, id: AblationId) -> Result<()> {
    if ablations::all_played(tx, id).await? {
        let now = tx.now;
        ablations::set_over(tx, id, None, now).await?;
        tx.record(Subject::Ablation(id), Event::AblationFinished);
    }
    Ok(())
}

async fn fail_ablation(tx: &mut Tx, id: AblationId, reason: &str) -> Result<()> {
    for run in ablations::runs(tx, id).await? {
        runs::stop(tx, run).await?;
    }
    let now = tx.now;
    ablations::set_over(tx, id, Some(reason), now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Ablation(id), Event::AblationFailed { reason });
    Ok(())
}
