//! A job server whose calls a test can intercept.

use crate::{
    local::LocalServer,
    server::{ClaimResult, JobServer, LeaseStatus, QueueVersion, ReleaseReason},
};
use faceoff_types::GameId;
use faceoff_wire::{
    job::{JobReport, Lease},
    remote::LiveGameUpdate,
};
use std::{sync::Arc, time::Duration};
use tokio_util::sync::CancellationToken;

/// A call that a test can observe, and fail with an error.
pub(super) enum Interception<'a> {
    /// The server has stored this report; the slot does not know yet.
    Committed(&'a JobReport),
    /// A job is about to be released.
    Releasing,
}

type Interceptor = dyn Fn(Interception<'_>) -> anyhow::Result<()> + Send + Sync;

pub(super) struct InterceptedServer {
    server: LocalServer,
    intercept: Box<Interceptor>,
}

impl InterceptedServer {
    /// Wraps `server`, and calls `intercept` at each of these calls.
    pub(super) fn wrap(
        server: LocalServer,
        intercept: impl Fn(Interception<'_>) -> anyhow::Result<()> + Send + Sync + 'static,
    ) -> Arc<dyn JobServer> {
        Arc::new(Self {
            server,
            intercept: Box::new(intercept),
        })
    }
}

impl JobServer for InterceptedServer {
    fn claim(&self, slot: &str) -> anyhow::Result<ClaimResult> {
        self.server.claim(slot)
    }

    fn renew(&self, lease: &Lease, episodes_done: u32) -> anyhow::Result<LeaseStatus> {
        self.server.renew(lease, episodes_done)
    }

    fn publish_game(&self, lease: &Lease, attempt: (GameId, u32), update: LiveGameUpdate) {
        self.server.publish_game(lease, attempt, update);
    }

    fn commit(&self, lease: &Lease, report: JobReport) -> anyhow::Result<LeaseStatus> {
        let status = self.server.commit(lease, report.clone())?;
        (self.intercept)(Interception::Committed(&report))?;
        Ok(status)
    }

    fn release(&self, lease: &Lease, reason: ReleaseReason<'_>) -> anyhow::Result<()> {
        (self.intercept)(Interception::Releasing)?;
        self.server.release(lease, reason)
    }

    fn is_full_disk(&self, error: &anyhow::Error) -> bool {
        self.server.is_full_disk(error)
    }

    fn wait(
        &self,
        stop: &CancellationToken,
        timeout: Duration,
        queue_version: Option<QueueVersion>,
    ) {
        self.server.wait(stop, timeout, queue_version);
    }
}
