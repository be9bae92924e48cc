//! A slot: the place in a worker that runs one job at a time, on its own thread. Here are its loop (claim, run, commit or
//! release) and its pauses after platform faults. A *platform fault* is a failure that the agent did not cause.

use crate::{
    executor::Executor,
    lease::{LeaseKeeper, Progress},
    server::{ClaimResult, JobServer, LeaseStatus, ReleaseReason, TooLarge},
};
use faceoff_metrics::{JobEnd, Metrics};
use faceoff_runner::PlatformFault;
use faceoff_wire::job::{JobPayload, JobReport, JobSpec};
use std::{
    panic::AssertUnwindSafe,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// How long a slot claims no job after a platform fault: twice as long after each further fault in a row. Otherwise a slot
/// with a broken sandbox or disk would use up the attempts of all pending jobs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Backoff {
    /// Pause after the first fault.
    pub(crate) first: Duration,
    /// Longest pause.
    pub(crate) longest: Duration,
}

impl Backoff {
    /// Pause after this many faults in a row.
    fn after(self, faults: u32) -> Duration {
        let doubled = 1_u32.checked_shl(faults.saturating_sub(1));
        let pause = doubled.and_then(|times| self.first.checked_mul(times));
        pause.unwrap_or(self.longest).min(self.longest)
    }
}

/// A slot: claims and runs jobs, one at a time, on its own thread.
pub(crate) struct Slot {
    pub(crate) name: String,
    /// Number of the slot, its label in metrics.
    pub(crate) number: String,
    pub(crate) metrics: Metrics,
    /// How often an idle slot polls the queue for jobs that became claimable without a signal: by an expired lease, at
    /// the end of a back-off, or by another process.
    pub(crate) idle_poll: Duration,
    pub(crate) backoff: Backoff,
    pub(crate) server: Arc<dyn JobServer>,
    pub(crate) executor: Executor,
    pub(crate) shutdown: CancellationToken,
}

impl Slot {
    /// Runs jobs until the shutdown.
    pub(crate) fn run(mut self) {
        // Only the first of several failures in a row is logged.
        let mut last_claim_failed = false;
        // Platform faults in a row.
        let mut faults = 0;
        while !self.shutdown.is_cancelled() {
            let queue_version = match self.server.claim(&self.name) {
                Ok(ClaimResult::Job(job)) => {
                    last_claim_failed = false;
                    match self.run_job(&job) {
                        JobEnd::Committed => faults = 0,
                        JobEnd::PlatformFault => {
                            faults += 1;
                            self.back_off(faults);
                        }
                        JobEnd::Lost | JobEnd::FullDisk => {}
                    }
                    continue;
                }
                Ok(ClaimResult::Empty { queue_version }) => {
                    last_claim_failed = false;
                    Some(queue_version)
                }
                Err(error) => {
                    if !last_claim_failed {
                        tracing::error!(
                            cause = format!("{error:#}"),
                            "cannot claim a job; trying again"
                        );
                    }
                    last_claim_failed = true;
                    None
                }
            };
            self.server
                .wait(&self.shutdown, self.idle_poll, queue_version);
        }
    }

    /// Pauses after a platform fault.
    fn back_off(&self, faults: u32) {
        let pause = self.backoff.after(faults);
        tracing::warn!(
            slot = self.name,
            ?pause,
            faults,
            "pausing after a platform fault"
        );
        let end = Instant::now() + pause;
        while !self.shutdown.is_cancelled() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            self.server.wait(&self.shutdown, left, None);
        }
    }

    fn run_job(&mut self, job: &JobSpec) -> JobEnd {
        let (id, payload) = (job.lease.job_id, &job.payload);
        // All log lines of this thread carry the job's ids until the span ends.
        let _span = span(job).entered();
        tracing::info!(job = %id, description = %payload, "started");
        let (job_metrics, started_at) = (
            self.metrics.slots().start_job(kind_label(payload)),
            Instant::now(),
        );
        // A panic in the evaluator must end neither the slot nor the evaluation.
        let result = std::panic::catch_unwind(AssertUnwindSafe(|| self.execute(job)))
            .unwrap_or_else(|panic| {
                Err(anyhow::anyhow!(
                    "the evaluator failed: {}",
                    panic_message(&*panic)
                ))
            });
        let end = match result {
            Ok(LeaseStatus::Held) => {
                tracing::info!(job = %id, description = %payload, "committed");
                JobEnd::Committed
            }
            Ok(LeaseStatus::Lost) => {
                tracing::info!(job = %id, description = %payload, "lease lost");
                JobEnd::Lost
            }
            Err(error) => {
                let end = if self.server.is_full_disk(&error) {
                    JobEnd::FullDisk
                } else {
                    JobEnd::PlatformFault
                };
                self.release(job, &error);
                end
            }
        };
        job_metrics.end(end, started_at.elapsed());
        end
    }

    /// Runs and commits a job. An error is a platform fault.
    fn execute(&mut self, job: &JobSpec) -> anyhow::Result<LeaseStatus> {
        let keeper =
            LeaseKeeper::start(Arc::clone(&self.server), job.lease.clone(), &self.shutdown)?;
        let progress = keeper.progress();
        let committed = self.executor.run(job, &progress).and_then(|report| {
            let status = self.commit(job, &report, &progress)?;
            if status == LeaseStatus::Held {
                self.record_metrics(&report);
            }
            Ok(status)
        });
        // The drop waits for a renewal in progress: if it shows that the lease is lost, the error is not a platform fault.
        drop(keeper);
        match committed {
            // This is no fault: the job was released or cancelled, or another slot has it.
            Err(error) if progress.must_stop() || self.has_lost_lease(job, &progress) => {
                tracing::info!(job = %job.lease.job_id, cause = format!("{error:#}"), "stopped");
                Ok(LeaseStatus::Lost)
            }
            committed => committed,
        }
    }

    /// Has the slot lost its lease? Asked after an error, because without the lease the server refuses a remote worker the files of
    /// the job, and the lease keeper may not have noticed the loss yet.
    fn has_lost_lease(&self, job: &JobSpec, progress: &Progress) -> bool {
        let status = self.server.renew(&job.lease, progress.episodes_done());
        matches!(status, Ok(LeaseStatus::Lost))
    }

    /// Records the episodes of a shard in the metrics.
    fn record_metrics(&self, report: &JobReport) {
        if let (JobReport::Shard { outcomes, .. }, Some(timing)) = (report, &self.executor.timing) {
            let slots = self.metrics.slots();
            slots.record_episodes(&self.number, outcomes, timing);
        }
    }

    /// Commits the report. While the disk is full it tries again, so that the job need not be repeated.
    fn commit(
        &self,
        job: &JobSpec,
        report: &JobReport,
        progress: &Progress,
    ) -> anyhow::Result<LeaseStatus> {
        let id = job.lease.job_id;
        let mut is_full_disk_logged = false;
        loop {
            let committed = self.server.commit(&job.lease, report.clone());
            match committed {
                Err(error) if self.server.is_full_disk(&error) && !progress.must_stop() => {
                    if !is_full_disk_logged {
                        tracing::warn!(job = %id, cause = format!("{error:#}"), "disk full: waiting to commit");
                        is_full_disk_logged = true;
                    }
                    self.server.wait(&self.shutdown, self.idle_poll, None);
                }
                committed => return committed,
            }
        }
    }

    /// Releases the job after a platform fault or because of a full disk.
    fn release(&self, job: &JobSpec, error: &anyhow::Error) {
        let id = job.lease.job_id;
        let cause = format!("{error:#}");
        // The cause names folders of this host, so the team gets only a summary and the job's id.
        let summary = format!("{} (in the server's log: job {id})", public_reason(error));
        let reason = if self.server.is_full_disk(error) {
            tracing::warn!(job = %id, description = %job.payload, cause, "disk full: job released");
            ReleaseReason::FullDisk
        } else {
            tracing::error!(job = %id, description = %job.payload, cause, "platform fault");
            ReleaseReason::PlatformFault(&summary)
        };
        loop {
            match self.server.release(&job.lease, reason) {
                Ok(()) => return,
                // Without a release the lease would expire, and the attempt would count.
                Err(error) if self.server.is_full_disk(&error) && !self.shutdown.is_cancelled() => {
                    self.server.wait(&self.shutdown, self.idle_poll, None);
                }
                Err(error) => {
                    tracing::error!(job = %id, cause = format!("{error:#}"), "the job could not be released; its lease will expire");
                    return;
                }
            }
        }
    }
}

/// A span with the ids of the job and of what it belongs to.
fn span(job: &JobSpec) -> tracing::Span {
    let (id, slot) = (job.lease.job_id, &job.lease.holder);
    match &job.payload {
        JobPayload::Validation { submission, .. } => {
            tracing::info_span!("slot", job = %id, slot, %submission)
        }
        // For ablations and proposals, the field `evaluation` has their id.
        JobPayload::Shard { part_of, .. } => {
            tracing::info_span!("slot", job = %id, slot, evaluation = %part_of)
        }
        JobPayload::Game { game, .. } => tracing::info_span!("slot", job = %id, slot, %game),
        JobPayload::Scoring { evaluation, .. } => {
            tracing::info_span!("slot", job = %id, slot, %evaluation)
        }
    }
}

/// Label of the kind of job in metrics. Dashboards filter by these labels, so they stay as they were introduced.
const fn kind_label(payload: &JobPayload) -> &'static str {
    match payload {
        JobPayload::Validation { .. } => "smoke",
        JobPayload::Shard { .. } => "play",
        JobPayload::Game { .. } => "game",
        JobPayload::Scoring { .. } => "finalise",
    }
}

/// The description of a platform fault for the team.
fn public_reason(error: &anyhow::Error) -> &'static str {
    if error.is::<TooLarge>() {
        return "the result exceeds the max_payload of NATS, which must be raised";
    }
    match error.downcast_ref::<PlatformFault>() {
        Some(PlatformFault::Sandbox(_)) => "the sandbox could not be set up",
        Some(PlatformFault::Io { .. }) => "a file could not be read or written",
        Some(PlatformFault::FullDisk(_) | PlatformFault::Recording(_)) => {
            "the recording could not be made"
        }
        Some(
            PlatformFault::Simulation(_)
            | PlatformFault::Simulator(_)
            | PlatformFault::UnknownTask(_)
            | PlatformFault::InvalidConditions(_),
        ) => "the simulator failed",
        Some(PlatformFault::HostBusy(_)) => "the host kept an agent from answering",
        Some(PlatformFault::Cancelled) | None => "the evaluator failed",
    }
}

/// The message of a panic.
fn panic_message(panic: &(dyn std::any::Any + Send)) -> &str {
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
    fn backoff_doubles_up_to_the_longest() {
        let backoff = Backoff {
            first: Duration::from_secs(2),
            longest: Duration::from_secs(300),
        };
        let pauses =
            [1, 2, 3, 8, 9, 32, 33, u32::MAX].map(|faults| backoff.after(faults).as_secs());
        assert_eq!(pauses, [2, 4, 8, 256, 300, 300, 300, 300]);
    }
}
