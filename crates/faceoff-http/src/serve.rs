//! Accepts connections, limits their number and duration, and closes them at shutdown.
//!
//! A client costs a file descriptor and some memory before its first byte is parsed. So the time to send a request is
//! limited, responses must be read at a minimum rate, and each address has a maximum number of connections. The
//! remaining descriptors are for the evaluator, the part of this process that runs agents.

mod connection_quota;
mod min_rate_stream;

use crate::{
    peer::Peer,
    proxies::{ProxyNetwork, TrustedProxies},
};
use axum::{Extension, Router, http::HeaderName};
use connection_quota::ConnectionQuota;
use faceoff_service::{
    problem::{Problem, ProblemKind},
    shutdown::Shutdown,
    transfer_rate::MinTransferRate,
};
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::GracefulShutdown,
    service::TowerToHyperService,
};
use min_rate_stream::MinRateStream;
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

/// Pause after an error of the listener itself, usually because no file descriptor is left. New connections wait meanwhile.
const ACCEPT_PAUSE: Duration = Duration::from_millis(500);
/// How much of a response may wait unsent in the kernel's send buffer. Without a bound the buffer grows to megabytes, and
/// is refilled only when a third of it is free: a slow but steady reader would look like one that reads nothing.
const MAX_UNSENT_BYTES: u32 = 128 << 10;
/// How often the log repeats that all connections are in use, or that none can be accepted.
const LOG_INTERVAL: Duration = Duration::from_secs(60);

/// Limits of client connections.
#[derive(Debug, Clone)]
pub struct ConnectionLimits {
    /// Open connections in total. Further ones wait to be accepted.
    pub open: usize,
    /// Open connections of one address (IPv6: of one /64). Further ones get an error response and are closed.
    pub per_address: usize,
    /// Addresses and networks without a limit: those of proxies, which all clients share.
    pub exempt: Vec<ProxyNetwork>,
    /// The header in which these proxies name their clients.
    pub forwarded_header: HeaderName,
    /// Time to send the head of a request, counted from the opening or from the end of the last response. So it also
    /// limits how long a connection may be idle.
    pub head_timeout: Duration,
    /// How fast a client must read a response.
    pub min_read_rate: MinTransferRate,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            open: 1024,
            per_address: 64,
            exempt: [
                IpAddr::from([127, 0, 0, 1]),
                IpAddr::from([0, 0, 0, 0, 0, 0, 0, 1_u16]),
            ]
            .map(ProxyNetwork::from)
            .into(),
            forwarded_header: HeaderName::from_static("x-forwarded-for"),
            head_timeout: Duration::from_secs(30),
            min_read_rate: MinTransferRate {
                bytes_per_s: 1024,
                grace: Duration::from_secs(60),
            },
        }
    }
}

/// Answers requests until `shutdown_signal` completes, and then finishes the requests in flight. An error of a connection
/// ends that connection; after an error of the listener, the function tries again.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    limits: ConnectionLimits,
    shutdown_signal: impl Future<Output = ()> + Send + 'static,
) {
    let mut acceptor = Acceptor {
        listener,
        permits: Arc::new(Semaphore::new(limits.open)),
        full_logged_at: None,
        failure_logged_at: None,
    };
    let proxies = TrustedProxies::new(limits.exempt.clone(), limits.forwarded_header);
    let proxies = Arc::new(proxies);
    let quota = Arc::new(ConnectionQuota::new(limits.per_address, limits.exempt));
    let limit_response: Arc<[u8]> = limit_response(limits.per_address).into();
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(limits.head_timeout);
    let graceful = GracefulShutdown::new();
    // Event streams end only with their game or after an hour: without this extension, shutdown would wait for them.
    let (shutdown_sender, shutdown) = Shutdown::new();
    let router = router.layer(Extension(shutdown));
    let mut shutdown_signal = pin!(shutdown_signal);
    loop {
        let (stream, client, permit) = tokio::select! {
            () = &mut shutdown_signal => break,
            accepted = acceptor.accept() => accepted,
        };
        let Some(address_permit) = quota.acquire(client.ip()) else {
            refuse(stream, &limit_response);
            continue;
        };
        if let Err(error) = SockRef::from(&stream).set_tcp_notsent_lowat(MAX_UNSENT_BYTES) {
            tracing::debug!(from = %client, %error, "cannot bound the send buffer; a slow client may be dropped too early");
        }
        let stream = MinRateStream::new(stream, limits.min_read_rate, reset_on_close);
        let peer = Peer {
            address: client.ip(),
            proxies: Arc::clone(&proxies),
        };
        let service = TowerToHyperService::new(Extension(peer).layer(router.clone()));
        let connection = graceful.watch(http.serve_connection(TokioIo::new(stream), service));
        tokio::spawn(async move {
            if let Err(error) = connection.await {
                tracing::debug!(from = %client, %error, "a connection failed");
            }
            drop((address_permit, permit));
        });
    }
    drop(acceptor);
    shutdown_sender.send_replace(true);
    graceful.shutdown().await;
}

/// Accepts connections, up to the total limit.
struct Acceptor {
    listener: TcpListener,
    permits: Arc<Semaphore>,
    /// When the log last said that all connections are in use.
    full_logged_at: Option<Instant>,
    /// When the log last said that no connection can be accepted. `None` once one is accepted again.
    failure_logged_at: Option<Instant>,
}

impl Acceptor {
    /// The next connection, once a permit is free. Connections that wait to be accepted cost memory of the system, but no
    /// descriptor of this process.
    async fn accept(&mut self) -> (TcpStream, SocketAddr, OwnedSemaphorePermit) {
        loop {
            if self.permits.available_permits() == 0 && is_log_due(self.full_logged_at) {
                tracing::warn!("all connections are in use; new ones wait until one is closed");
                self.full_logged_at = Some(Instant::now());
            }
            let Ok(permit) = Arc::clone(&self.permits).acquire_owned().await else {
                // The semaphore is never closed.
                return std::future::pending().await;
            };
            match self.listener.accept().await {
                Ok((stream, client)) => {
                    self.failure_logged_at = None;
                    return (stream, client, permit);
                }
                Err(error) if is_peer_gone(&error) => {}
                Err(error) => {
                    if is_log_due(self.failure_logged_at) {
                        tracing::error!(%error, "no connection can be accepted; trying again");
                        self.failure_logged_at = Some(Instant::now());
                    }
                    tokio::time::sleep(ACCEPT_PAUSE).await;
                }
            }
        }
    }
}

/// Whether a message that was last logged at `logged_at` may be logged again.
fn is_log_due(logged_at: Option<Instant>) -> bool {
    logged_at.is_none_or(|logged_at| logged_at.elapsed() > LOG_INTERVAL)
}

/// Whether the error says only that the client disconnected before it was accepted.
fn is_peer_gone(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionRefused
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::Interrupted
    )
}

/// Makes closing reset the connection: data that the client does not read must not stay in the kernel's buffers for minutes.
fn reset_on_close(stream: &TcpStream) {
    // If this fails, the data stays there for a while, which does no harm.
    let _ = stream.set_zero_linger();
}

/// The complete HTTP response to an address that has too many connections.
fn limit_response(per_address: usize) -> Vec<u8> {
    let problem = Problem::new(
        ProblemKind::TooManyConnections,
        format!("an address has at most {per_address} connections; close some, or use one for many requests"),
    )
    .with("limit", per_address);
    problem.as_http1()
}

/// Sends the response if the kernel accepts it at once, and closes the connection.
fn refuse(stream: TcpStream, response: &[u8]) {
    if let Ok(mut stream) = stream.into_std() {
        let _ = stream.write_all(response);
    }
}
