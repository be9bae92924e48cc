//! Transfer of files between the server (or its bucket) and a remote worker. An attempt continues as long as data
//! moves, and failures on the way are retried.

use reqwest::{Client, Response, StatusCode, header};
use std::{
    pin::pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};
use tokio::time::{Instant, sleep, sleep_until};

/// Transfers files with timeouts and retries.
#[derive(Debug, Clone)]
pub(super) struct FileTransfer {
    /// HTTP client without a timeout of its own: reqwest's read timeout also runs while a body is sent, even if data moves.
    pub(super) http: Client,
    pub(super) timeouts: TransferTimeouts,
}

/// Timeouts and retry limits of transfers.
#[derive(Debug, Clone, Copy)]
pub(super) struct TransferTimeouts {
    /// An attempt is stopped after this time without progress.
    pub(super) stall_timeout: Duration,
    /// Retries end this long after the last progress. The server may be restarting meanwhile.
    pub(super) retry_timeout: Duration,
    /// Maximum number of attempts interrupted after some progress. More are a sign that a proxy refuses files of this size.
    pub(super) max_interrupted: u32,
    /// Delay before a retry.
    pub(super) retry_delay: Duration,
    /// Maximum delay before a retry, if the server requests a longer one.
    pub(super) max_retry_delay: Duration,
}

impl Default for TransferTimeouts {
    fn default() -> Self {
        Self {
            stall_timeout: Duration::from_secs(60),
            retry_timeout: Duration::from_secs(60),
            max_interrupted: 10,
            retry_delay: Duration::from_secs(2),
            max_retry_delay: Duration::from_secs(30),
        }
    }
}

/// How often to check whether the job has ended.
const END_CHECK_INTERVAL: Duration = Duration::from_millis(500);
/// Upper bound of the data in this host's buffers after a whole body was written: 4 MiB in the kernel, the rest in the HTTP
/// client.
const BUFFERED_BYTES: u64 = 5 << 20;
/// Speed of the slowest supported link, at which the buffers are emptied: 128 kbit/s.
const SLOWEST_BYTES_PER_S: u64 = 16_000;

/// Progress of an attempt.
#[derive(Debug, Clone)]
pub(super) struct TransferProgress(Arc<Mutex<ProgressState>>);

#[derive(Debug)]
struct ProgressState {
    /// When data last moved; initially the start of the attempt.
    progressed_at: Instant,
    /// Bytes transferred so far.
    bytes: u64,
    /// Size of a file that is sent; unknown for downloads.
    total_bytes: Option<u64>,
}

impl TransferProgress {
    fn new() -> Self {
        Self(Arc::new(Mutex::new(ProgressState {
            progressed_at: Instant::now(),
            bytes: 0,
            total_bytes: None,
        })))
    }

    /// Sets the size of the file that is sent.
    pub(super) fn set_total(&self, total_bytes: u64) {
        self.state().total_bytes = Some(total_bytes);
    }

    /// Adds bytes that were transferred.
    pub(super) fn add(&self, bytes: usize) {
        let mut state = self.state();
        state.progressed_at = Instant::now();
        state.bytes += bytes as u64;
    }

    /// Waits until there was no progress for the duration `stall`.
    async fn wait_for_stall(&self, stall: Duration) {
        loop {
            let deadline = self.state().stall_deadline(stall);
            if deadline <= Instant::now() {
                return;
            }
            sleep_until(deadline).await;
        }
    }

    fn state(&self) -> MutexGuard<'_, ProgressState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ProgressState {
    /// When the attempt counts as stalled without further progress. A file that was written completely may still be in this
    /// host's buffers, which take time to empty.
    fn stall_deadline(&self, stall: Duration) -> Instant {
        let in_buffers = match self.total_bytes {
            Some(total) if self.bytes >= total => total.min(BUFFERED_BYTES),
            _ => 0,
        };
        self.progressed_at + stall + Duration::from_secs(in_buffers / SLOWEST_BYTES_PER_S)
    }
}

/// A failure of an attempt that may succeed when retried.
#[derive(Debug, thiserror::Error)]
enum TransientError {
    /// The server, or a proxy before it, is overloaded.
    #[error("the server answered {status}")]
    Busy {
        status: StatusCode,
        retry_after: Option<Duration>,
    },
    #[error("no progress for {} s", .0.as_secs())]
    Stalled(Duration),
}

/// The job has ended, so its files are not needed.
#[derive(Debug, thiserror::Error)]
#[error("the job has ended")]
struct JobEnded;

impl FileTransfer {
    /// Repeats `attempt` until it succeeds, is refused, or the retry limits are reached. Stops as soon as the job
    /// `has_ended`.
    pub(super) async fn run(
        &self,
        mut attempt: impl AsyncFnMut(&Client, &TransferProgress) -> anyhow::Result<()>,
        has_ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let timeouts = &self.timeouts;
        let mut attempts = Attempts::default();
        let mut job_end = pin!(async {
            while !has_ended() {
                sleep(END_CHECK_INTERVAL).await;
            }
        });
        loop {
            let progress = TransferProgress::new();
            let result = tokio::select! {
                biased;
                done = attempt(&self.http, &progress) => done,
                () = &mut job_end => return Err(JobEnded.into()),
                () = progress.wait_for_stall(timeouts.stall_timeout) => Err(TransientError::Stalled(timeouts.stall_timeout).into()),
            };
            let Err(error) = result else {
                return Ok(());
            };
            let Some(delay) = attempts.retry_delay(&error, &progress, timeouts) else {
                return Err(error);
            };
            tokio::select! {
                () = &mut job_end => return Err(error),
                () = sleep(delay) => {}
            }
        }
    }
}

/// The failed attempts so far.
#[derive(Debug, Default)]
struct Attempts {
    failed: u32,
    /// Attempts that failed after some progress.
    interrupted: u32,
    /// Start of the current period without progress.
    unavailable_since: Option<Instant>,
}

impl Attempts {
    /// The delay before the next attempt; `None` if the transfer is given up. There is at least one retry, except after a
    /// refusal.
    fn retry_delay(
        &mut self,
        error: &anyhow::Error,
        progress: &TransferProgress,
        timeouts: &TransferTimeouts,
    ) -> Option<Duration> {
        let transient = error.downcast_ref::<TransientError>();
        if transient.is_none() && !is_connection_error(error) {
            return None;
        }
        self.failed += 1;
        let (progressed_at, bytes) = {
            let state = progress.state();
            (state.progressed_at, state.bytes)
        };
        match transient {
            // Data sent to an overloaded server does not count as progress.
            Some(TransientError::Busy { .. }) => {
                self.unavailable_since.get_or_insert(progressed_at);
            }
            _ if bytes > 0 => {
                self.interrupted += 1;
                self.unavailable_since = Some(progressed_at);
            }
            _ => {
                self.unavailable_since.get_or_insert(progressed_at);
            }
        }
        let is_expired = self
            .unavailable_since
            .is_some_and(|since| since.elapsed() >= timeouts.retry_timeout);
        if (is_expired && self.failed > 1) || self.interrupted >= timeouts.max_interrupted {
            return None;
        }
        Some(match transient {
            Some(TransientError::Busy {
                retry_after: Some(delay),
                ..
            }) => (*delay)
                .min(timeouts.max_retry_delay)
                .max(timeouts.retry_delay),
            _ => timeouts.retry_delay,
        })
    }
}

/// Did the connection fail, before or during the transfer?
fn is_connection_error(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.downcast_ref::<reqwest::Error>().is_some_and(|error| {
            let is_before = error.is_connect() || error.is_timeout() || error.is_request();
            // The other two occur while the response is read.
            is_before || error.is_body() || error.is_decode()
        })
    })
}

/// Turns an error status of the response into an error.
pub(super) async fn check_status(response: Response) -> anyhow::Result<Response> {
    let status = response.status();
    if status.is_success() {
        return Ok(response);
    }
    if status == StatusCode::INSUFFICIENT_STORAGE {
        return Err(std::io::Error::from(std::io::ErrorKind::StorageFull).into());
    }
    if status.is_server_error()
        || [StatusCode::REQUEST_TIMEOUT, StatusCode::TOO_MANY_REQUESTS].contains(&status)
    {
        let retry_after = response.headers().get(header::RETRY_AFTER);
        let retry_after = retry_after.and_then(|value| value.to_str().ok()?.trim().parse().ok());
        return Err(TransientError::Busy {
            status,
            retry_after: retry_after.map(Duration::from_secs),
        }
        .into());
    }
    let message = response.text().await.unwrap_or_default();
    anyhow::bail!("the server answered {status}: {message}")
}

#[cfg(test)]
mod tests;
