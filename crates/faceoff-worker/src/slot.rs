use crate::{
    lease::LeaseKeeper,
    units::{End, Ended, Tools},
};
use faceoff_runner::{EvaluationMeta, PlatformFault};
use faceoff_store::{Claimed, RunOwner, Work};
use faceoff_types::RULESET;
use std::{panic::AssertUnwindSafe, time::Duration};
use tokio_util::sync::CancellationToken;

/// One slot: claims units and works them off, one at a time, on its own thread.
pub(crate) struct Slot {
    pub(crate) name: String,
    pub(crate) lease_s: u32,
    /// How long to wait, idle, before looking for units that became claimable by the passing of time:
    /// an expired lease, the end of a back-off, work added by another process.
    pub(crate) poll: Duration,
    pub(crate) tools: Tools,
    pub(crate) shutdown: CancellationToken,
}

impl Slot {
    /// Works until the shutdown.
    pub(crate) fn run(mut self) {
        let mut signal = self.tools.store.work_signal();
        while !self.shutdown.is_cancelled() {
            // Seen before the claim, so that what is queued right after it wakes the wait.
            signal.borrow_and_update();
            let claimed = self.tools.handle.block_on(self.tools.store.claim(
                &self.name,
                self.lease_s,
                self.tools.clock.now(),
            ));
            match claimed {
                Ok(Some(claimed)) => self.work_on(&claimed),
                Ok(None) => self.wait_for(Some(&mut signal)),
                Err(error) => {
                    tracing::error!(%error, "cannot claim work; trying again");
                    self.wait_for(None);
                }
            }
        }
    }

    fn wait_for(&self, signal: Option<&mut tokio::sync::watch::Receiver<u64>>) {
        self.tools.handle.block_on(async {
            let added = async {
                match signal {
                    Some(signal) => drop(signal.changed().await),
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                () = self.shutdown.cancelled() => {}
                () = added => {}
                () = tokio::time::sleep(self.poll) => {}
            }
        });
    }

    fn work_on(&mut self, claimed: &Claimed) {
        let Claimed { claim, work } = claimed;
        let keeper = LeaseKeeper::keep(
            &self.tools.handle,
            self.tools.store.clone(),
            claim.clone(),
            self.lease_s,
            self.tools.clock.clone(),
            self.shutdown.clone(),
        );
        tracing::info!(unit = %claim.unit, work = %Description(work), "begun");
        // A defect of ours in the middle of an episode must not end the slot, nor the evaluation.
        let ended = std::panic::catch_unwind(AssertUnwindSafe(|| self.perform(claimed, &keeper)))
            .unwrap_or_else(|panic| {
                Err(anyhow::anyhow!("the evaluator failed: {}", words(&*panic)))
            });
        match ended {
            Ok(End::Committed) => {
                tracing::info!(unit = %claim.unit, work = %Description(work), "committed");
            }
            Ok(End::Stopped) => {
                tracing::info!(unit = %claim.unit, work = %Description(work), "no longer this slot's");
            }
            Err(error) => self.give_back(claimed, &keeper, &error),
        }
    }

    fn perform(&mut self, claimed: &Claimed, keeper: &LeaseKeeper) -> Ended {
        let Claimed { claim, work } = claimed;
        match work {
            Work::Smoke { submission } => self.tools.smoke(claim, submission, &keeper.progress()),
            Work::Shard {
                run,
                shard,
                bundle,
                seeds,
                ..
            } => self
                .tools
                .shard(claim, (run, *seeds), shard, bundle, keeper.progress()),
            Work::Finalise {
                evaluation,
                run,
                recordings,
                agent_name,
                seeds,
            } => {
                let meta = EvaluationMeta {
                    profile: run.plan.profile,
                    seed: seeds.episodes,
                    mismatch_seed: seeds.mismatch,
                    agent: agent_name.clone(),
                    ruleset: RULESET.to_owned(),
                };
                self.tools.finalise(claim, *evaluation, &meta, recordings)
            }
        }
    }

    /// Our fault. A unit whose lease was lost or given back stays as it is.
    fn give_back(&self, claimed: &Claimed, keeper: &LeaseKeeper, error: &anyhow::Error) {
        let Claimed { claim, work } = claimed;
        if keeper.progress().stopped() {
            tracing::info!(unit = %claim.unit, work = %Description(work), cause = format!("{error:#}"), "stopped");
            return;
        }
        tracing::error!(unit = %claim.unit, work = %Description(work), cause = format!("{error:#}"), "platform fault");
        // The cause names folders of this host; a team is told enough to ask about it.
        let reason = format!(
            "{} (in the server's log: unit {})",
            outside(error),
            claim.unit
        );
        let released = self.tools.handle.block_on(self.tools.store.release_failed(
            claim,
            &reason,
            self.tools.clock.now(),
        ));
        if let Err(error) = released {
            tracing::error!(unit = %claim.unit, %error, "the unit could not be given back; its lease will end");
        }
    }
}

/// What a team may know of a fault of ours.
fn outside(error: &anyhow::Error) -> &'static str {
    match error.downcast_ref::<PlatformFault>() {
        Some(PlatformFault::Sandbox(_)) => "the sandbox could not be set up",
        Some(PlatformFault::Io { .. }) => "a file could not be read or written",
        Some(PlatformFault::Recording(_)) => "the recording could not be made",
        Some(PlatformFault::Cancelled) | None => "the evaluator failed",
    }
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no reason given")
}

/// A unit in a log line.
struct Description<'a>(&'a Work);

impl std::fmt::Display for Description<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Work::Smoke { submission, .. } => {
                write!(f, "smoke run of submission {}", submission.id)
            }
            Work::Shard {
                owner, run, shard, ..
            } => {
                write!(
                    f,
                    "{} episodes {} to {} with {} of ",
                    shard.task,
                    shard.first_episode,
                    shard.end_episode - 1,
                    run.plan.profile
                )?;
                match owner {
                    RunOwner::Evaluation(id) => write!(f, "evaluation {id}"),
                    RunOwner::Ablation(id) => write!(f, "ablation {id}"),
                }
            }
            Work::Finalise { evaluation, .. } => {
                write!(f, "finalisation of evaluation {evaluation}")
            }
        }
    }
}
