//! The HTTP server and its shutdown.

use anyhow::Context;
use faceoff_http::ConnectionLimits;
use std::time::Duration;
use tokio::{net::TcpListener, signal::unix::SignalKind};
use tokio_util::sync::CancellationToken;

/// Time that open connections have after the shutdown signal.
const GRACE_PERIOD: Duration = Duration::from_secs(10);

/// Serves requests until `shutdown`, and open connections for [`GRACE_PERIOD`] longer.
pub async fn serve_http(
    listener: TcpListener,
    router: faceoff_http::Router,
    connections: ConnectionLimits,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let shutdown_requested = shutdown.clone();
    let server = faceoff_http::serve(listener, router, connections, async move {
        shutdown_requested.cancelled().await;
    });
    let timeout = async {
        shutdown.cancelled().await;
        tokio::time::sleep(GRACE_PERIOD).await;
    };
    tokio::select! {
        () = server => Ok(()),
        () = timeout => {
            tracing::warn!("closing connections that are still open after {} s", GRACE_PERIOD.as_secs());
            Ok(())
        }
    }
}

/// The future resolves to the name of the first shutdown signal.
pub fn shutdown_signal() -> anyhow::Result<impl Future<Output = &'static str>> {
    let listen = |kind| tokio::signal::unix::signal(kind).context("listening for signals");
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => "SIGINT",
            _ = terminate.recv() => "SIGTERM",
        }
    })
}
