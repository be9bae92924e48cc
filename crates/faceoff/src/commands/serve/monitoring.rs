//! Monitoring: a separate address for metrics, and counters of the season's changes.

use anyhow::Context;
use faceoff_http::{ConnectionLimits, HttpConfig};
use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_store::{Change, Store};
use std::net::SocketAddr;
use tokio::{net::TcpListener, sync::broadcast::error::RecvError};
use tokio_util::sync::CancellationToken;

/// Binds the address of the metrics, which should not be public.
///
/// # Errors
/// If the address cannot be bound.
pub async fn listen(address: SocketAddr) -> anyhow::Result<TcpListener> {
    let bound = TcpListener::bind(address).await;
    bound.with_context(|| {
        format!("listening on {address} for metrics; choose another server.metrics_listen")
    })
}

/// Serves metrics until `shutdown`.
pub async fn serve_metrics(
    listener: TcpListener,
    store: Store,
    live: LiveState,
    config: HttpConfig,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let router = faceoff_http::monitoring_router(store, live, config);
    let shutdown = shutdown.cancelled_owned();
    faceoff_http::serve(listener, router, ConnectionLimits::default(), shutdown).await;
    Ok(())
}

/// Counts the season's changes by kind, as metrics, until `shutdown`. Changes are the events of the database's log.
pub async fn count_changes(
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
            Ok(Change::Recorded(record)) => metrics.record_event(&record.event.kind()),
            // Progress within a job is not in the log.
            Ok(Change::Progress(_)) => {}
            Err(RecvError::Lagged(missed)) => metrics.record_missed_events(missed),
            Err(RecvError::Closed) => return Ok(()),
        }
    }
}
