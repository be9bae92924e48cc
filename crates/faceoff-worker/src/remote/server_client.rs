//! The server as a remote slot sees it. Jobs, requests and results go over NATS, files over the server's HTTP or a bucket.

use super::{connection::REQUEST_TIMEOUT, job_files::JobFiles, worker_link::WorkerLink};
use crate::{
    files::FileStore,
    full_disk,
    server::{ClaimResult, JobServer, LeaseStatus, QueueVersion, ReleaseReason},
};
use anyhow::Context as _;
use async_nats::jetstream::{self, consumer::PullConsumer};
use faceoff_dataset::CLIPS_FILE;
use faceoff_types::{BundleRef, GameId};
use faceoff_wire::{
    job::{JobReport, Lease},
    remote::{
        LiveGameMessage, LiveGameUpdate, RemoteJob, RemoteJobEnd, WorkerRequest, WorkerResponse,
    },
};
use std::{
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use tokio_util::sync::CancellationToken;

/// Pause after a refusal or a failure.
pub(super) const RETRY_INTERVAL: Duration = Duration::from_secs(2);
/// How long a worker with a full disk claims no job. Each job that it releases waits for a while, so it would delay the
/// whole queue.
const FULL_DISK_PAUSE: Duration = Duration::from_secs(10);

/// The connection of one slot to the server.
pub(super) struct ServerClient {
    pub(super) link: Arc<WorkerLink>,
    pub(super) jetstream: jetstream::Context,
    /// The consumer of jobs, cached until a failure.
    pub(super) consumer: Mutex<Option<PullConsumer>>,
    current_job: Mutex<CurrentJob>,
    /// When this worker's disk was last full.
    disk_full_at: Mutex<Option<Instant>>,
}

/// The job that the slot runs.
#[derive(Debug, Default)]
struct CurrentJob {
    files: Arc<JobFiles>,
    /// When the lease was last confirmed by the server.
    confirmed_at: Option<Instant>,
    /// Is the lease lost?
    is_lost: bool,
    /// The problem that prevents sending the result.
    send_problem: Option<String>,
}

impl ServerClient {
    pub(super) fn new(link: Arc<WorkerLink>) -> Self {
        Self {
            jetstream: jetstream::new(link.client.clone()),
            link,
            consumer: Mutex::default(),
            current_job: Mutex::default(),
            disk_full_at: Mutex::default(),
        }
    }

    /// Was this worker's disk full within [`FULL_DISK_PAUSE`]?
    fn had_full_disk(&self) -> bool {
        let disk_full_at = self
            .disk_full_at
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        disk_full_at.is_some_and(|at| at.elapsed() < FULL_DISK_PAUSE)
    }

    fn current_job(&self) -> MutexGuard<'_, CurrentJob> {
        self.current_job
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Must the slot stop its job, because of a lost lease or the shutdown?
    pub(super) fn must_stop_job(&self) -> bool {
        self.current_job().is_lost || self.link.shutdown.is_cancelled()
    }

    /// Records why the result cannot be sent; the next renewal reports it to the server.
    pub(super) fn set_send_problem(&self, cause: &str) {
        self.current_job().send_problem = Some(cause.to_owned());
    }

    /// The files of the current job.
    fn files(&self) -> Arc<JobFiles> {
        Arc::clone(&self.current_job().files)
    }

    async fn store_file(&self, name: &str, file: &Path) -> anyhow::Result<()> {
        let (files, transfer) = (self.files(), &self.link.file_transfer);
        files
            .store(transfer, name, file, || self.must_stop_job())
            .await
    }

    /// Waits for [`RETRY_INTERVAL`], or until the shutdown.
    pub(super) async fn pause(&self) {
        tokio::select! {
            () = self.link.shutdown.cancelled() => {}
            () = tokio::time::sleep(RETRY_INTERVAL) => {}
        }
    }
}

impl JobServer for ServerClient {
    fn claim(&self, slot: &str) -> anyhow::Result<ClaimResult> {
        // The version is not used: NATS wakes slots that wait for a job.
        let queue_version = QueueVersion(0);
        self.link.runtime.block_on(async {
            if self.had_full_disk() {
                self.pause().await;
                return Ok(ClaimResult::Empty { queue_version });
            }
            match self.register().await {
                Ok(true) => {}
                Ok(false) => {
                    self.pause().await;
                    return Ok(ClaimResult::Empty { queue_version });
                }
                Err(error) => {
                    self.pause().await;
                    return Err(error);
                }
            }
            let job = match self.next_job(slot).await {
                Ok(job) => job,
                Err(error) => {
                    *self.consumer.lock().unwrap_or_else(PoisonError::into_inner) = None;
                    self.pause().await;
                    return Err(error);
                }
            };
            let Some(RemoteJob {
                job,
                grant,
                files_url,
                objects,
                ..
            }) = job
            else {
                return Ok(ClaimResult::Empty { queue_version });
            };
            self.link.mark_busy();
            *self.current_job() = CurrentJob {
                files: Arc::new(JobFiles {
                    grant,
                    files_url,
                    objects,
                }),
                confirmed_at: Some(Instant::now()),
                is_lost: false,
                send_problem: None,
            };
            Ok(ClaimResult::Job(Box::new(job)))
        })
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<LeaseStatus> {
        self.link.mark_busy();
        let request = WorkerRequest::RenewLease {
            lease: lease.clone(),
            episodes_done,
            send_problem: self.current_job().send_problem.clone(),
        };
        let response = self.link.runtime.block_on(self.link.request(&request));
        match response {
            Ok(WorkerResponse::Accepted) => {
                self.current_job().confirmed_at = Some(Instant::now());
                Ok(LeaseStatus::Held)
            }
            Ok(WorkerResponse::Refused { .. }) => {
                self.current_job().is_lost = true;
                Ok(LeaseStatus::Lost)
            }
            Ok(WorkerResponse::Unavailable) | Err(_) => {
                let confirmed_at = self.current_job().confirmed_at;
                let timeout = Duration::from_secs(lease.duration_s.into());
                if confirmed_at.is_some_and(|at| at.elapsed() > timeout) {
                    tracing::error!(job = %lease.job_id, "no contact to the server for the duration of the lease: the job is stopped");
                    self.current_job().is_lost = true;
                    return Ok(LeaseStatus::Lost);
                }
                response
                    .map(|_| LeaseStatus::Held)
                    .and_then(|_| anyhow::bail!("the server cannot answer now"))
            }
        }
    }

    fn renewal_interval(&self, _: &Lease) -> Duration {
        // A short interval, so that a worker soon learns of a lost lease.
        Duration::from_millis(500)
    }

    fn publish_game(&self, lease: &Lease, (game, attempt): (GameId, u32), update: LiveGameUpdate) {
        let message = LiveGameMessage {
            lease: lease.clone(),
            game,
            attempt,
            update,
        };
        self.link.runtime.block_on(self.link.publish_game(&message));
    }

    fn commit(&self, lease: &Lease, report: JobReport) -> anyhow::Result<LeaseStatus> {
        let (report, files) = (Box::new(report), self.files());
        let episodes_done = report.episodes();
        let status = self.link.runtime.block_on(async {
            let sent = self.send_result(lease, &files.grant, RemoteJobEnd::Done { report });
            let Some(sequence) = sent.await? else {
                return anyhow::Ok(LeaseStatus::Lost);
            };
            let request = WorkerRequest::ResultPending {
                lease: lease.clone(),
                episodes_done,
                sequence,
            };
            // From now on the server renews the lease. Without this request it would learn of the result only when it
            // reads it, perhaps after the lease has expired.
            if let Err(error) = self.link.request(&request).await {
                tracing::debug!(%error, "the server could not be informed of the pending result");
            }
            anyhow::Ok(LeaseStatus::Held)
        })?;
        self.link.mark_busy();
        Ok(status)
    }

    fn release(&self, lease: &Lease, reason: ReleaseReason<'_>) -> anyhow::Result<()> {
        let end = match reason {
            ReleaseReason::Interrupted => RemoteJobEnd::Interrupted,
            ReleaseReason::FullDisk => {
                let mut disk_full_at = self
                    .disk_full_at
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner);
                *disk_full_at = Some(Instant::now());
                RemoteJobEnd::FullDisk
            }
            ReleaseReason::PlatformFault(summary) => RemoteJobEnd::PlatformFault {
                reason: summary.to_owned(),
            },
        };
        let files = self.files();
        self.link.runtime.block_on(async {
            let sent =
                tokio::time::timeout(REQUEST_TIMEOUT, self.send_result(lease, &files.grant, end));
            sent.await.context("informing the server")?.map(drop)
        })
    }

    fn is_full_disk(&self, error: &anyhow::Error) -> bool {
        full_disk::is_cause_of(error)
    }

    fn wait(
        &self,
        stop: &CancellationToken,
        timeout: Duration,
        queue_version: Option<QueueVersion>,
    ) {
        // The caller has just claimed without success: the request for a job has already waited.
        if queue_version.is_some() {
            return;
        }
        self.link.runtime.block_on(async {
            tokio::select! {
                () = stop.cancelled() => {}
                () = tokio::time::sleep(timeout) => {}
            }
        });
    }
}

impl FileStore for ServerClient {
    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        let (files, transfer) = (self.files(), &self.link.file_transfer);
        let fetched = files.fetch_bundle(transfer, bundle, archive, || self.must_stop_job());
        self.link.runtime.block_on(fetched)
    }

    fn store_recording(&self, _: &str, folder: &Path) -> anyhow::Result<()> {
        self.link.runtime.block_on(async {
            let mut entries = tokio::fs::read_dir(folder).await?;
            while let Some(entry) = entries.next_entry().await? {
                let name = entry.file_name();
                let name = name.to_str().context("a recording's file without a name")?;
                self.store_file(name, &entry.path()).await?;
            }
            Ok(())
        })
    }

    fn store_clips(&self, _: &str, clips: &Path) -> anyhow::Result<()> {
        self.link
            .runtime
            .block_on(self.store_file(CLIPS_FILE, clips))
    }
}
