use crate::{
    executor::Executor,
    lease::{LeaseKeeper, Progress},
    remote::TooLarge,
    server::{Claimed, GivenBack, Holding, WorkServer},
};
use faceoff_metrics::{Metrics, UnitEnd};
use faceoff_runner::PlatformFault;
use faceoff_wire::work::{Assignment, WorkOrder, WorkReport};
use std::{
    panic::AssertUnwindSafe,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How long a slot leaves the queue to others after a fault of ours: twice as long each time, until it has played something. One whose
/// sandbox or folder is broken would use up the attempts at everything that waits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rests {
    /// After the first.
    pub(crate) first: Duration,
    /// At most.
    pub(crate) longest: Duration,
}

impl Rests {
    /// After so many faults in a row.
    fn after(self, faults: u32) -> Duration {
        let doubled = 1_u32.checked_shl(faults.saturating_sub(1));
        let rest = doubled.and_then(|times| self.first.checked_mul(times));
        rest.unwrap_or(self.longest).min(self.longest)
    }
}

/// One slot: claims units and works them off, one at a time, on its own thread.
pub(crate) struct Slot {
    pub(crate) name: String,
    /// As the server's numbers name it.
    pub(crate) number: String,
    pub(crate) metrics: Metrics,
    /// How long to wait, idle, before looking for units that became claimable by the passing of time:
    /// an expired lease, the end of a back-off, work added by another process.
    pub(crate) idle_poll: Duration,
    pub(crate) rests: Rests,
    pub(crate) server: Arc<dyn WorkServer>,
    pub(crate) executor: Executor,
    pub(crate) shutdown: CancellationToken,
}

impl Slot {
    /// Works until the shutdown.
    pub(crate) fn run(mut self) {
        // The log is told of a change, not of every try.
        let mut failing = false;
        // Since it last played something.
        let mut faults = 0;
        while !self.shutdown.is_cancelled() {
            let queue = match self.server.claim(&self.name) {
                Ok(Claimed::Order(order)) => {
                    failing = false;
                    match self.work_on(&order) {
                        UnitEnd::Committed => faults = 0,
                        UnitEnd::PlatformFault => {
                            faults += 1;
                            self.rest(faults);
                        }
                        UnitEnd::Lost | UnitEnd::FullDisk => {}
                    }
                    continue;
                }
                Ok(Claimed::Nothing { queue }) => {
                    failing = false;
                    Some(queue)
                }
                Err(error) => {
                    if !failing {
                        tracing::error!(
                            cause = format!("{error:#}"),
                            "cannot claim work; trying again"
                        );
                    }
                    failing = true;
                    None
                }
            };
            self.server.wait(&self.shutdown, self.idle_poll, queue);
        }
    }

    /// After a fault of ours.
    fn rest(&self, faults: u32) {
        let rest = self.rests.after(faults);
        tracing::warn!(
            slot = self.name,
            ?rest,
            faults,
            "resting after a platform fault"
        );
        let woken = Instant::now() + rest;
        while !self.shutdown.is_cancelled() {
            let left = woken.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            self.server.wait(&self.shutdown, left, None);
        }
    }

    fn work_on(&mut self, order: &WorkOrder) -> UnitEnd {
        let (unit, work) = (order.lease.unit, &order.assignment);
        // All that is logged meanwhile, by whatever this calls on the slot's thread, says for whom.
        let _span = span(order).entered();
        tracing::info!(%unit, %work, "begun");
        let (busy, began) = (self.metrics.slots().begin(kind(work)), Instant::now());
        // A defect of ours in the middle of an episode must not end the slot, nor the evaluation.
        let ended = std::panic::catch_unwind(AssertUnwindSafe(|| self.perform(order)))
            .unwrap_or_else(|panic| {
                Err(anyhow::anyhow!("the evaluator failed: {}", words(&*panic)))
            });
        let end = match ended {
            Ok(Holding::Held) => {
                tracing::info!(%unit, %work, "committed");
                UnitEnd::Committed
            }
            Ok(Holding::Lost) => {
                tracing::info!(%unit, %work, "no longer this slot's");
                UnitEnd::Lost
            }
            Err(error) => {
                let end = if self.server.met_full_disk(&error) {
                    UnitEnd::FullDisk
                } else {
                    UnitEnd::PlatformFault
                };
                self.give_back(order, &error);
                end
            }
        };
        busy.end(end, began.elapsed());
        end
    }

    /// From order to commit. An error is a fault of ours.
    fn perform(&mut self, order: &WorkOrder) -> anyhow::Result<Holding> {
        let keeper = LeaseKeeper::keep(
            Arc::clone(&self.server),
            order.lease.clone(),
            &self.shutdown,
        )?;
        let progress = keeper.progress();
        let committed = self.executor.report(order, &progress).and_then(|report| {
            let holding = self.commit(order, &report, &progress)?;
            if holding == Holding::Held {
                self.count(&report);
            }
            Ok(holding)
        });
        // Whatever it is being told is told by then: whose the unit is decides what an error is.
        drop(keeper);
        match committed {
            // no fault: the unit was given back, or is another's
            Err(error) if progress.stopped() => {
                tracing::info!(unit = %order.lease.unit, cause = format!("{error:#}"), "stopped");
                Ok(Holding::Lost)
            }
            committed => committed,
        }
    }

    /// Counts what came of a unit.
    fn count(&self, report: &WorkReport) {
        if let (WorkReport::Play { outcomes, .. }, Some(timing)) = (report, &self.executor.timing) {
            let slots = self.metrics.slots();
            slots.played(&self.number, outcomes, timing);
        }
    }

    /// Commits; while a full disk is in the way, again and again: what was played need not be played
    /// twice for that.
    fn commit(
        &self,
        order: &WorkOrder,
        report: &WorkReport,
        progress: &Progress,
    ) -> anyhow::Result<Holding> {
        let unit = order.lease.unit;
        let mut told = false;
        loop {
            let committed = self.server.commit(&order.lease, report.clone());
            match committed {
                Err(error) if self.server.met_full_disk(&error) && !progress.stopped() => {
                    if !told {
                        tracing::warn!(%unit, cause = format!("{error:#}"), "no room to commit; waiting for it");
                        told = true;
                    }
                    self.server.wait(&self.shutdown, self.idle_poll, None);
                }
                committed => return committed,
            }
        }
    }

    /// Our fault, or a full disk's.
    fn give_back(&self, order: &WorkOrder, error: &anyhow::Error) {
        let unit = order.lease.unit;
        let cause = format!("{error:#}");
        // The cause names folders of this host; a team is told enough to ask about it.
        let reason = format!("{} (in the server's log: unit {unit})", outside(error));
        let why = if self.server.met_full_disk(error) {
            tracing::warn!(%unit, work = %order.assignment, cause, "no room for the unit: it is given back");
            GivenBack::FullDisk
        } else {
            tracing::error!(%unit, work = %order.assignment, cause, "platform fault");
            GivenBack::PlatformFault(&reason)
        };
        loop {
            match self.server.give_back(&order.lease, why) {
                Ok(()) => return,
                // Without this its lease would end, and that would count against it.
                Err(error)
                    if self.server.met_full_disk(&error) && !self.shutdown.is_cancelled() =>
                {
                    self.server.wait(&self.shutdown, self.idle_poll, None);
                }
                Err(error) => {
                    tracing::error!(%unit, cause = format!("{error:#}"), "the unit could not be given back; its lease will end");
                    return;
                }
            }
        }
    }
}

/// Names the unit, and whose work it is.
fn span(order: &WorkOrder) -> tracing::Span {
    let (unit, slot) = (order.lease.unit, &order.lease.slot);
    match &order.assignment {
        Assignment::Smoke { submission, .. } => {
            tracing::info_span!("slot", %unit, slot, %submission)
        }
        // Of an ablation or a draft it is theirs.
        Assignment::Play { part_of, .. } => {
            tracing::info_span!("slot", %unit, slot, evaluation = %part_of)
        }
        Assignment::Game { game, .. } => tracing::info_span!("slot", %unit, slot, %game),
        Assignment::Finalise { evaluation, .. } => {
            tracing::info_span!("slot", %unit, slot, %evaluation)
        }
    }
}

/// As the server's numbers call it.
const fn kind(work: &Assignment) -> &'static str {
    match work {
        Assignment::Smoke { .. } => "smoke",
        Assignment::Play { .. } => "play",
        Assignment::Game { .. } => "game",
        Assignment::Finalise { .. } => "finalise",
    }
}

/// What a team may know of a fault of ours.
fn outside(error: &anyhow::Error) -> &'static str {
    if error.is::<TooLarge>() {
        return "what came of it is larger than NATS takes: its max_payload is to be raised";
    }
    match error.downcast_ref::<PlatformFault>() {
        Some(PlatformFault::Sandbox(_)) => "the sandbox could not be set up",
        Some(PlatformFault::Io { .. }) => "a file could not be read or written",
        Some(PlatformFault::FullDisk(_) | PlatformFault::Recording(_)) => {
            "the recording could not be made"
        }
        Some(PlatformFault::Simulation(_)) => "the simulator failed",
        Some(PlatformFault::HostBusy(_)) => "the host kept an agent from answering",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_double_up_to_the_longest() {
        let rests = Rests {
            first: Duration::from_secs(2),
            longest: Duration::from_secs(300),
        };
        let rests = [1, 2, 3, 8, 9, 32, 33, u32::MAX].map(|faults| rests.after(faults).as_secs());
        assert_eq!(rests, [2, 4, 8, 256, 300, 300, 300, 300]);
    }
}
