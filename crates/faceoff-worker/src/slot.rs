use crate::{
    executor::Executor,
    lease::LeaseKeeper,
    server::{Claimed, GivenBack, Holding, WorkServer},
};
use faceoff_runner::PlatformFault;
use faceoff_wire::work::WorkOrder;
use std::{panic::AssertUnwindSafe, sync::Arc, time::Duration};
use tokio_util::sync::CancellationToken;

/// One slot: claims units and works them off, one at a time, on its own thread.
pub(crate) struct Slot {
    pub(crate) name: String,
    /// How long to wait, idle, before looking for units that became claimable by the passing of time:
    /// an expired lease, the end of a back-off, work added by another process.
    pub(crate) idle_poll: Duration,
    pub(crate) server: Arc<dyn WorkServer>,
    pub(crate) executor: Executor,
    pub(crate) shutdown: CancellationToken,
}

impl Slot {
    /// Works until the shutdown.
    pub(crate) fn run(mut self) {
        while !self.shutdown.is_cancelled() {
            let queue = match self.server.claim(&self.name) {
                Ok(Claimed::Order(order)) => {
                    self.work_on(&order);
                    continue;
                }
                Ok(Claimed::Nothing { queue }) => Some(queue),
                Err(error) => {
                    tracing::error!(
                        cause = format!("{error:#}"),
                        "cannot claim work; trying again"
                    );
                    None
                }
            };
            self.server.wait(&self.shutdown, self.idle_poll, queue);
        }
    }

    fn work_on(&mut self, order: &WorkOrder) {
        let (unit, work) = (order.lease.unit, &order.assignment);
        tracing::info!(%unit, %work, "begun");
        // A defect of ours in the middle of an episode must not end the slot, nor the evaluation.
        let ended = std::panic::catch_unwind(AssertUnwindSafe(|| self.perform(order)))
            .unwrap_or_else(|panic| {
                Err(anyhow::anyhow!("the evaluator failed: {}", words(&*panic)))
            });
        match ended {
            Ok(Holding::Held) => tracing::info!(%unit, %work, "committed"),
            Ok(Holding::Lost) => tracing::info!(%unit, %work, "no longer this slot's"),
            Err(error) => self.give_back(order, &error),
        }
    }

    /// From order to commit. An error is a fault of ours.
    fn perform(&mut self, order: &WorkOrder) -> anyhow::Result<Holding> {
        let keeper = LeaseKeeper::keep(
            Arc::clone(&self.server),
            order.lease.clone(),
            &self.shutdown,
        )?;
        let progress = keeper.progress();
        let committed = self
            .executor
            .report(&order.assignment, &progress)
            .and_then(|report| self.server.commit(&order.lease, report));
        match committed {
            // no fault: the unit was given back, or is another's
            Err(error) if progress.stopped() => {
                tracing::info!(unit = %order.lease.unit, cause = format!("{error:#}"), "stopped");
                Ok(Holding::Lost)
            }
            committed => committed,
        }
    }

    /// Our fault.
    fn give_back(&self, order: &WorkOrder, error: &anyhow::Error) {
        let unit = order.lease.unit;
        tracing::error!(%unit, work = %order.assignment, cause = format!("{error:#}"), "platform fault");
        // The cause names folders of this host; a team is told enough to ask about it.
        let reason = format!("{} (in the server's log: unit {unit})", outside(error));
        let given_back = self
            .server
            .give_back(&order.lease, GivenBack::PlatformFault(&reason));
        if let Err(error) = given_back {
            tracing::error!(%unit, cause = format!("{error:#}"), "the unit could not be given back; its lease will end");
        }
    }
}

/// What a team may know of a fault of ours.
fn outside(error: &anyhow::Error) -> &'static str {
    match error.downcast_ref::<PlatformFault>() {
        Some(PlatformFault::Sandbox(_)) => "the sandbox could not be set up",
        Some(PlatformFault::Io { .. }) => "a file could not be read or written",
        Some(PlatformFault::Recording(_)) => "the recording could not be made",
        Some(PlatformFault::Simulation(_)) => "the simulator failed",
        Some(PlatformFault::HostBusy(_)) => "the host kept the agent from answering",
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
