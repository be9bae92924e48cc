//! A remote worker's connection to the message broker NATS, shared by its slots (each runs one job at a time).

use super::{connection::REQUEST_TIMEOUT, names::Names, transfer::FileTransfer};
use anyhow::Context as _;
use async_nats::{Client, connection::State};
use faceoff_types::WorkerName;
use faceoff_wire::remote::{LiveGameMessage, WorkerCapabilities, WorkerRequest, WorkerResponse};
use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// Timeout for publishing a live update.
const UPDATE_TIMEOUT: Duration = Duration::from_millis(20);

/// The connection, and the state shared by all slots.
pub(super) struct WorkerLink {
    /// The async runtime on which the threads of slots wait for NATS and HTTP.
    pub(super) runtime: Handle,
    pub(super) client: Client,
    pub(super) names: Names,
    pub(super) worker: WorkerName,
    pub(super) capabilities: WorkerCapabilities,
    pub(super) file_transfer: FileTransfer,
    pub(super) shutdown: CancellationToken,
    /// The last logged reason of a refusal. Only changes are logged.
    pub(super) refusal: Mutex<Option<String>>,
    /// The last logged cause of an unreadable job. Only changes are logged.
    pub(super) unreadable_cause: Mutex<String>,
    /// When a slot of this worker last had a job.
    pub(super) busy_at: Mutex<Instant>,
    /// When the server last accepted the registration.
    pub(super) registered_at: Mutex<Option<Instant>>,
}

impl WorkerLink {
    /// How long no slot has had a job.
    pub(super) fn idle_for(&self) -> Duration {
        let busy_at = self.busy_at.lock();
        busy_at.unwrap_or_else(PoisonError::into_inner).elapsed()
    }

    pub(super) fn mark_busy(&self) {
        let mut busy_at = self.busy_at.lock().unwrap_or_else(PoisonError::into_inner);
        *busy_at = Instant::now();
    }

    /// Requires a new registration before the next job.
    pub(super) fn invalidate_registration(&self) {
        let mut registered_at = self
            .registered_at
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *registered_at = None;
    }

    /// Sends a request to the server and waits for the response.
    pub(super) async fn request(&self, request: &WorkerRequest) -> anyhow::Result<WorkerResponse> {
        let payload = serde_json::to_vec(request)?;
        let subject = self.names.requests(self.worker.as_str());
        let response = with_timeout(self.client.request(subject, payload.into())).await;
        let response = response.context("asking the server")?;
        serde_json::from_slice(&response.payload).context("the server's response")
    }

    /// Publishes a live update of a game, if that is possible without delay.
    pub(super) async fn publish_game(&self, message: &LiveGameMessage) {
        // Without a connection the client would queue the update, in a limited buffer.
        if self.client.connection_state() != State::Connected {
            return;
        }
        let Ok(payload) = serde_json::to_vec(message) else {
            return;
        };
        let subject = self.names.live_games(self.worker.as_str());
        let published = self.client.publish(subject, payload.into());
        // A late update is dropped.
        let _ = tokio::time::timeout(UPDATE_TIMEOUT, published).await;
    }
}

/// A request to NATS with a timeout. The client's own timeout starts only when the request enters its buffer, which is full
/// after a long time without a connection.
pub(super) async fn with_timeout<T, E: Into<anyhow::Error>>(
    request: impl IntoFuture<Output = Result<T, E>>,
) -> anyhow::Result<T> {
    let response = tokio::time::timeout(REQUEST_TIMEOUT, request.into_future()).await;
    response
        .context("NATS has not answered in time")?
        .map_err(Into::into)
}
