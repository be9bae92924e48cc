//! A worker's connection, shared by its slots.

use super::{connection::ANSWER, names::Names, transfer::Carrier};
use anyhow::Context as _;
use async_nats::{Client, connection::State};
use faceoff_store::WorkerName;
use faceoff_wire::remote::{Answer, Ask, Introduction, RemoteShow};
use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;

/// Nobody waits longer to show a position.
const SHOWS_WITHIN: Duration = Duration::from_millis(20);

/// The connection, and what all slots know.
pub(super) struct Link {
    pub(super) runtime: Handle,
    pub(super) client: Client,
    pub(super) names: Names,
    pub(super) worker: WorkerName,
    pub(super) own: Introduction,
    pub(super) carrier: Carrier,
    pub(super) shutdown: CancellationToken,
    /// Why it may not work, as it was told last: the log is told of a change.
    pub(super) refused: Mutex<Option<String>>,
    /// Why an order could not be read, likewise.
    pub(super) unread: Mutex<String>,
    /// When a slot last had something to do.
    pub(super) busy_at: Mutex<Instant>,
    /// When the server last said that it may work.
    pub(super) may_work_at: Mutex<Option<Instant>>,
}

impl Link {
    /// For how long no slot has had anything to do.
    pub(super) fn idle_for(&self) -> Duration {
        let busy_at = self.busy_at.lock();
        busy_at.unwrap_or_else(PoisonError::into_inner).elapsed()
    }

    pub(super) fn is_busy(&self) {
        let mut busy_at = self.busy_at.lock().unwrap_or_else(PoisonError::into_inner);
        *busy_at = Instant::now();
    }

    /// Before it works again, it is to ask whether it may.
    pub(super) fn must_ask(&self) {
        let mut at = self
            .may_work_at
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        *at = None;
    }

    pub(super) async fn ask(&self, ask: &Ask) -> anyhow::Result<Answer> {
        let question = serde_json::to_vec(ask)?;
        let subject = self.names.asks(self.worker.as_str());
        let answer = within(self.client.request(subject, question.into())).await;
        let answer = answer.context("asking the server")?;
        serde_json::from_slice(&answer.payload).context("the server's answer")
    }

    /// Shows a position to those who watch, if it arrives while it is one.
    pub(super) async fn show(&self, show: &RemoteShow) {
        // Without a connection it would be kept, and the client has only so much room for all that is said.
        if self.client.connection_state() != State::Connected {
            return;
        }
        let Ok(words) = serde_json::to_vec(show) else {
            return;
        };
        let subject = self.names.shows(self.worker.as_str());
        let published = self.client.publish(subject, words.into());
        // What is not shown in time is not shown.
        let _ = tokio::time::timeout(SHOWS_WITHIN, published).await;
    }
}

/// What NATS is asked for. The client measures time only once it has taken a question in, for which it has no room when it has been without a
/// connection for long.
pub(super) async fn within<T, E: Into<anyhow::Error>>(
    asked: impl IntoFuture<Output = Result<T, E>>,
) -> anyhow::Result<T> {
    let answered = tokio::time::timeout(ANSWER, asked.into_future()).await;
    answered
        .context("NATS has not answered in time")?
        .map_err(Into::into)
}
