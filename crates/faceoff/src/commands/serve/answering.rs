//! Requests, until the server is asked to end.

use anyhow::Context;
use faceoff_http::ConnectionLimits;
use std::time::Duration;
use tokio::{net::TcpListener, signal::unix::SignalKind};
use tokio_util::sync::CancellationToken;

/// How long open connections may go on after the signal to end.
const GRACE: Duration = Duration::from_secs(10);

/// Answers until `shutdown`, and for [`GRACE`] what is under way then.
pub async fn answer(
    listener: TcpListener,
    router: faceoff_http::Router,
    connections: ConnectionLimits,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let asked = shutdown.clone();
    let serving = faceoff_http::serve(listener, router, connections, async move {
        asked.cancelled().await;
    });
    let late = async {
        shutdown.cancelled().await;
        tokio::time::sleep(GRACE).await;
    };
    tokio::select! {
        () = serving => Ok(()),
        () = late => {
            tracing::warn!("connections still open after {} s are cut", GRACE.as_secs());
            Ok(())
        }
    }
}

/// The future ends with the name of the signal that asks the server to end.
pub fn signalled() -> anyhow::Result<impl Future<Output = &'static str>> {
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
