//! For what watches the server: an address of its own, and what is counted of the season's changes.

use anyhow::Context;
use faceoff_http::{ConnectionLimits, HttpConfig};
use faceoff_metrics::Metrics;
use faceoff_store::{Change, Store};
use std::net::SocketAddr;
use tokio::{net::TcpListener, sync::broadcast::error::RecvError};
use tokio_util::sync::CancellationToken;

/// Listens where strangers do not come.
///
/// # Errors
/// If the address cannot be had.
pub async fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    let bound = TcpListener::bind(address).await;
    bound.with_context(|| {
        format!("listening on {address} for metrics; choose another server.metrics_listen")
    })
}

/// Answers there until `shutdown`.
pub async fn answer(
    listener: TcpListener,
    store: Store,
    config: HttpConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let router = faceoff_http::watching_router(store, config);
    let until = shutdown.cancelled_owned();
    faceoff_http::serve(listener, router, ConnectionLimits::default(), until).await;
    Ok(())
}

/// Counts what changes until `shutdown`.
pub async fn count(
    store: Store,
    metrics: Metrics,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let mut changes = store.events();
    loop {
        let change = tokio::select! {
            () = shutdown.cancelled() => return Ok(()),
            change = changes.recv() => change,
        };
        match change {
            Ok(Change::Recorded(record)) => metrics.happened(&record.event.kind()),
            Ok(Change::Progress(_)) => {}
            Err(RecvError::Lagged(missed)) => metrics.happened_untold(missed),
            Err(RecvError::Closed) => return Ok(()),
        }
    }
}
