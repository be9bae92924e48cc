//! The async tasks of a server, such as HTTP, slots and schedule, all of which run until the shutdown.

use super::http::shutdown_signal;
use anyhow::{Context, bail};
use faceoff_store::Store;
use sd_notify::NotifyState;
use tokio::task::{JoinError, JoinSet};
use tokio_util::sync::CancellationToken;

/// The running tasks. If one of them ends before the shutdown, the server stops.
#[derive(Default)]
pub(super) struct ServerTasks {
    tasks: JoinSet<anyhow::Result<()>>,
    shutdown: CancellationToken,
}

impl ServerTasks {
    /// Starts a task; the token that it gets is cancelled at the shutdown.
    pub(super) fn spawn<F>(&mut self, task: impl FnOnce(CancellationToken) -> F)
    where
        F: Future<Output = anyhow::Result<()>> + Send + 'static,
    {
        self.tasks.spawn(task(self.shutdown.clone()));
    }

    /// Waits for SIGINT or SIGTERM and then for the end of all tasks. A second signal ends the wait.
    ///
    /// # Errors
    /// The first error of a task, or if one ended before the signal.
    pub(super) async fn run_until_signal(mut self, store: &Store) -> anyhow::Result<()> {
        notify_service_manager(NotifyState::Ready);
        let signal = shutdown_signal()?;
        let mut outcome = Ok(());
        tokio::select! {
            name = signal => tracing::info!(signal = name, "shutting down: slots release their jobs"),
            Some(task) = self.tasks.join_next() => outcome = unexpected_end(task),
        }
        notify_service_manager(NotifyState::Stopping);
        self.shutdown.cancel();
        let end_of_tasks = async {
            while let Some(task) = self.tasks.join_next().await {
                let ended = task
                    .context("a part of the server panicked")
                    .and_then(|ended| ended);
                if outcome.is_ok() {
                    outcome = ended;
                }
            }
        };
        // A second signal stops the server immediately, which leases make safe.
        let second_signal = shutdown_signal()?;
        tokio::select! {
            () = end_of_tasks => {
                store.close().await;
                tracing::info!("stopped");
            }
            name = second_signal => tracing::warn!(signal = name, "second signal: stopping immediately"),
        }
        outcome
    }
}

/// Reports a state to the service manager that has started this program, if there is one.
fn notify_service_manager(state: NotifyState<'_>) {
    if let Err(error) = sd_notify::notify(&[state]) {
        tracing::warn!(%error, "cannot notify the service manager");
    }
}

/// The error of a task that ended before the shutdown.
fn unexpected_end(task: Result<anyhow::Result<()>, JoinError>) -> anyhow::Result<()> {
    match task {
        Ok(Ok(())) => bail!("a part of the server ended unexpectedly"),
        Ok(Err(error)) => Err(error),
        Err(panic) => Err(panic).context("a part of the server panicked"),
    }
}
