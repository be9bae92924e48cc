//! Files on their way to a worker or from it: a try goes on for as long as something of it moves, and what is lost on the way is tried
//! again.

use reqwest::{Client, Response, StatusCode, header};
use std::{
    pin::pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};
use tokio::time::{Instant, sleep, sleep_until};

/// Who carries files, and how patiently.
#[derive(Debug, Clone)]
pub(super) struct Carrier {
    /// Without a limit of its own on how long a file may take: reqwest's for reading runs while a body is sent, however well it is.
    pub(super) http: Client,
    pub(super) patience: Patience,
}

/// For how long what is waited for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patience {
    /// A try is given up once nothing of it has moved for so long.
    pub(super) still: Duration,
    /// Whoever has the files is asked again for so long after something last moved: the server may be starting anew.
    pub(super) away: Duration,
    /// What breaks in the middle so many times would do so for ever: somebody in between takes nothing of this size.
    pub(super) most_broken: u32,
    /// From one try to the next.
    pub(super) rest: Duration,
    /// Likewise, if whoever answers asks for more.
    pub(super) longest_rest: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            still: Duration::from_secs(60),
            away: Duration::from_secs(60),
            most_broken: 10,
            rest: Duration::from_secs(2),
            longest_rest: Duration::from_secs(30),
        }
    }
}

/// How often is looked whether a file is still wanted.
const LOOK: Duration = Duration::from_millis(500);
/// So much of a body may be on its way in buffers of this host when all of it has been handed over: 4 MiB of the kernel's, and HTTP's.
const BUFFERED_BYTES: u64 = 5 << 20;
/// The slowest link by which they are emptied: 128 kbit/s.
const SLOWEST_BYTES_PER_S: u64 = 16_000;

/// What of a try has moved.
#[derive(Debug, Clone)]
pub(super) struct Moved(Arc<Mutex<Since>>);

#[derive(Debug)]
struct Since {
    at: Instant,
    bytes: u64,
    /// What is sent, in all; of what is fetched nobody knows.
    all_bytes: Option<u64>,
}

impl Moved {
    fn nothing() -> Self {
        Self(Arc::new(Mutex::new(Since {
            at: Instant::now(),
            bytes: 0,
            all_bytes: None,
        })))
    }

    /// So much is to be sent.
    pub(super) fn of(&self, all_bytes: u64) {
        self.since().all_bytes = Some(all_bytes);
    }

    /// So much more has moved.
    pub(super) fn add(&self, bytes: usize) {
        let mut since = self.since();
        since.at = Instant::now();
        since.bytes += bytes as u64;
    }

    /// Waits until nothing has moved for so long.
    async fn stands_still(&self, still: Duration) {
        loop {
            let end = self.since().patience_ends(still);
            if end <= Instant::now() {
                return;
            }
            sleep_until(end).await;
        }
    }

    fn since(&self) -> MutexGuard<'_, Since> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Since {
    fn patience_ends(&self, still: Duration) -> Instant {
        let in_buffers = match self.all_bytes {
            Some(all) if self.bytes >= all => all.min(BUFFERED_BYTES),
            _ => 0,
        };
        self.at + still + Duration::from_secs(in_buffers / SLOWEST_BYTES_PER_S)
    }
}

/// Why a try came to nothing without anybody's refusal.
#[derive(Debug, thiserror::Error)]
enum Unfinished {
    /// The server, or the proxy before it, has no time now.
    #[error("the server answered {status}")]
    Busy {
        status: StatusCode,
        retry_after: Option<Duration>,
    },
    #[error("nothing has moved for {} s", .0.as_secs())]
    StoodStill(Duration),
}

/// The file is not wanted any more.
#[derive(Debug, thiserror::Error)]
#[error("the order has ended")]
struct Ended;

impl Carrier {
    /// Tries until it is done, it is refused, or nobody can be expected to be there; a try ends as soon as the order has `ended`.
    pub(super) async fn carry(
        &self,
        mut once: impl AsyncFnMut(&Client, &Moved) -> anyhow::Result<()>,
        ended: impl Fn() -> bool,
    ) -> anyhow::Result<()> {
        let patience = &self.patience;
        let mut tries = Tries::default();
        let mut is_over = pin!(async {
            while !ended() {
                sleep(LOOK).await;
            }
        });
        loop {
            let moved = Moved::nothing();
            let tried = tokio::select! {
                biased;
                done = once(&self.http, &moved) => done,
                () = &mut is_over => return Err(Ended.into()),
                () = moved.stands_still(patience.still) => Err(Unfinished::StoodStill(patience.still).into()),
            };
            let Err(error) = tried else {
                return Ok(());
            };
            let Some(rest) = tries.rest_after(&error, &moved, patience) else {
                return Err(error);
            };
            tokio::select! {
                () = &mut is_over => return Err(error),
                () = sleep(rest) => {}
            }
        }
    }
}

/// The tries so far.
#[derive(Debug, Default)]
struct Tries {
    failed: u32,
    /// Of those, the ones of which something had moved.
    broken: u32,
    /// When something last moved.
    away_since: Option<Instant>,
}

impl Tries {
    /// How long to rest before the next try, if there is to be one: there is one at least unless it was refused.
    fn rest_after(
        &mut self,
        error: &anyhow::Error,
        moved: &Moved,
        patience: &Patience,
    ) -> Option<Duration> {
        let unfinished = error.downcast_ref::<Unfinished>();
        if unfinished.is_none() && !is_lost(error) {
            return None;
        }
        self.failed += 1;
        let (at, bytes) = {
            let since = moved.since();
            (since.at, since.bytes)
        };
        match unfinished {
            // Whatever was sent to it went for nothing.
            Some(Unfinished::Busy { .. }) => {
                self.away_since.get_or_insert(at);
            }
            _ if bytes > 0 => {
                self.broken += 1;
                self.away_since = Some(at);
            }
            _ => {
                self.away_since.get_or_insert(at);
            }
        }
        let is_away = self
            .away_since
            .is_some_and(|at| at.elapsed() >= patience.away);
        if (is_away && self.failed > 1) || self.broken >= patience.most_broken {
            return None;
        }
        Some(match unfinished {
            Some(Unfinished::Busy {
                retry_after: Some(rest),
                ..
            }) => (*rest).min(patience.longest_rest).max(patience.rest),
            _ => patience.rest,
        })
    }
}

/// Was it lost on the way?
fn is_lost(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.downcast_ref::<reqwest::Error>().is_some_and(|error| {
            let before = error.is_connect() || error.is_timeout() || error.is_request();
            // In the middle of what it answers.
            before || error.is_body() || error.is_decode()
        })
    })
}

/// An answer that is no refusal.
pub(super) async fn good(answer: Response) -> anyhow::Result<Response> {
    let status = answer.status();
    if status.is_success() {
        return Ok(answer);
    }
    if status == StatusCode::INSUFFICIENT_STORAGE {
        return Err(std::io::Error::from(std::io::ErrorKind::StorageFull).into());
    }
    if status.is_server_error()
        || [StatusCode::REQUEST_TIMEOUT, StatusCode::TOO_MANY_REQUESTS].contains(&status)
    {
        let retry_after = answer.headers().get(header::RETRY_AFTER);
        let retry_after = retry_after.and_then(|value| value.to_str().ok()?.trim().parse().ok());
        return Err(Unfinished::Busy {
            status,
            retry_after: retry_after.map(Duration::from_secs),
        }
        .into());
    }
    let told = answer.text().await.unwrap_or_default();
    anyhow::bail!("the server answered {status}: {told}")
}

#[cfg(test)]
mod tests;
