//! Connections: who may open how many, how long they may hold them, and how they end.
//!
//! A stranger costs a descriptor and some memory before a single byte was understood. So a connection has
//! a bounded time to say what it wants, one that is answered must take the answer, and nobody has more of
//! them than a share; what is left of the descriptors is the evaluator's.

mod addresses;
mod paced_stream;

use crate::peer::Peer;
use addresses::Addresses;
use axum::{Extension, Router};
use faceoff_service::{
    ending::Ending,
    pace::LeastRate,
    problem::{Problem, ProblemKind},
};
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::GracefulShutdown,
    service::TowerToHyperService,
};
use paced_stream::PacedStream;
use socket2::SockRef;
use std::{
    io::{self, Write},
    net::{IpAddr, SocketAddr},
    pin::pin,
    sync::Arc,
    time::Duration,
};
use tokio::{
    net::{TcpListener, TcpStream},
    sync::{OwnedSemaphorePermit, Semaphore},
    time::Instant,
};
use tower::Layer as _;

/// After an error of the listener itself, most often for want of a descriptor. Connections wait meanwhile.
const ACCEPT_PAUSE: Duration = Duration::from_millis(500);
/// How much of an answer may lie unsent in the system's buffer. Without a bound it grows to megabytes, and
/// is refilled only when a third of it is gone: who reads steadily but slowly would look like one who reads
/// nothing.
const UNSENT_BYTES: u32 = 128 << 10;
/// How often the log says what lasts: that all connections are taken, or that none can be accepted.
const TOLD_EVERY: Duration = Duration::from_secs(60);

/// How much of the server strangers may hold, and for how long.
#[derive(Debug, Clone)]
pub struct ConnectionLimits {
    /// Connections at the same time. More wait to be accepted.
    pub open: usize,
    /// Connections of one address (IPv6: of one /64) at the same time. More are told so and closed.
    pub per_address: usize,
    /// Addresses without a bound of their own: a proxy's, behind which everybody is. What it says of whom it asks for is
    /// believed (`X-Forwarded-For`).
    pub exempt: Vec<IpAddr>,
    /// To send the head of a request, counted from the opening or from the end of the last answer: so also
    /// how long a connection may be idle.
    pub head: Duration,
    /// What a reader must take of an answer.
    pub reading: LeastRate,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            open: 1024,
            per_address: 64,
            exempt: vec![
                IpAddr::from([127, 0, 0, 1]),
                IpAddr::from([0, 0, 0, 0, 0, 0, 0, 1_u16]),
            ],
            head: Duration::from_secs(30),
            reading: LeastRate {
                bytes_per_s: 1024,
                grace: Duration::from_secs(60),
            },
        }
    }
}

/// Answers requests until `until` ends, and after that the ones that are under way. What fails of a
/// connection ends that connection; what fails of the listener is tried again.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    limits: ConnectionLimits,
    until: impl Future<Output = ()> + Send + 'static,
) {
    let mut door = Door {
        listener,
        places: Arc::new(Semaphore::new(limits.open)),
        told: None,
        told_of_failure: None,
    };
    let proxies: Arc<[IpAddr]> = limits.exempt.clone().into();
    let addresses = Arc::new(Addresses::new(limits.per_address, limits.exempt));
    let refusal: Arc<[u8]> = refusal(limits.per_address).into();
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(limits.head);
    let ending = GracefulShutdown::new();
    // Who follows a game would be waited for until that is over.
    let (ends, told) = Ending::new();
    let router = router.layer(Extension(told));
    let mut until = pin!(until);
    loop {
        let (stream, from, place) = tokio::select! {
            () = &mut until => break,
            accepted = door.accept() => accepted,
        };
        let Some(seat) = addresses.enter(from.ip()) else {
            refuse(stream, &refusal);
            continue;
        };
        if let Err(error) = SockRef::from(&stream).set_tcp_notsent_lowat(UNSENT_BYTES) {
            tracing::debug!(%from, %error, "a slow reader will look slower than it is");
        }
        let stream = PacedStream::new(stream, limits.reading, reset);
        let peer = Peer {
            address: from.ip(),
            proxies: Arc::clone(&proxies),
        };
        let service = TowerToHyperService::new(Extension(peer).layer(router.clone()));
        let answering = ending.watch(http.serve_connection(TokioIo::new(stream), service));
        tokio::spawn(async move {
            if let Err(error) = answering.await {
                tracing::debug!(%from, %error, "a connection ended");
            }
            drop((seat, place));
        });
    }
    drop(door);
    ends.send_replace(true);
    ending.shutdown().await;
}

/// Where connections come in.
struct Door {
    listener: TcpListener,
    places: Arc<Semaphore>,
    /// When the log last said that all places are taken.
    told: Option<Instant>,
    /// When it last said that none can be accepted, since one was.
    told_of_failure: Option<Instant>,
}

impl Door {
    /// The next connection, once there is a place for it: what waits outside costs the system's memory
    /// and none of our descriptors.
    async fn accept(&mut self) -> (TcpStream, SocketAddr, OwnedSemaphorePermit) {
        loop {
            if self.places.available_permits() == 0 && is_due(self.told) {
                tracing::warn!("all connections are taken; more wait until one ends");
                self.told = Some(Instant::now());
            }
            let Ok(place) = Arc::clone(&self.places).acquire_owned().await else {
                // Nobody closes it.
                return std::future::pending().await;
            };
            match self.listener.accept().await {
                Ok((stream, from)) => {
                    self.told_of_failure = None;
                    return (stream, from, place);
                }
                Err(error) if gone(&error) => {}
                Err(error) => {
                    if is_due(self.told_of_failure) {
                        tracing::error!(%error, "no connection can be accepted; trying again");
                        self.told_of_failure = Some(Instant::now());
                    }
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }
}

/// Is the log to say again what it said then?
fn is_due(told: Option<Instant>) -> bool {
    told.is_none_or(|told| told.elapsed() > TOLD_EVERY)
}

/// Did the peer go before it was let in?
fn gone(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionRefused
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::Interrupted
    )
}

/// Closes with a reset: what the peer does not take must not lie in the system's buffers for minutes.
fn reset(stream: &TcpStream) {
    // Without it, it lies there, and that is all.
    let _ = stream.set_zero_linger();
}

/// What an address gets that has too many connections, as a whole answer.
fn refusal(per_address: usize) -> Vec<u8> {
    let problem = Problem::new(
        ProblemKind::TooManyConnections,
        format!("an address has at most {per_address} connections; close some, or use one for many requests"),
    )
    .with("limit", per_address);
    problem.as_http1()
}

/// Says why, if that goes without waiting, and closes.
fn refuse(stream: TcpStream, refusal: &[u8]) {
    if let Ok(mut stream) = stream.into_std() {
        let _ = stream.write_all(refusal);
    }
}
