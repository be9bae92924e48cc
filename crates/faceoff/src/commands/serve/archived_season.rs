//! Serves an archived season read-only, without schedule and worker slots. Its data folder was created by `faceoff import`.

use super::{
    http::{serve_http, shutdown_signal},
    resources::{ServerResources, print_address},
};
use crate::competition::competition;
use crate::config::Config;
use anyhow::Context;
use faceoff_http::{AgentResources, Capacity, ConnectionLimits};
use faceoff_live::LiveState;
use faceoff_store::ArchivedSeason;
use faceoff_types::Clock;
use tokio_util::sync::CancellationToken;

/// Serves an archived season until SIGINT or SIGTERM, with the clock stopped at the time of the archive.
///
/// # Errors
/// If the data folder or the address is unusable.
pub async fn serve(
    config: Config,
    connections: ConnectionLimits,
    archived: ArchivedSeason,
) -> anyhow::Result<()> {
    let data_dir = &config.server.data_dir;
    let resources = ServerResources::open(&config, vec![data_dir.clone()]).await?;
    let (store, address) = (resources.store.clone(), resources.address);
    let made_at = archived.made_at;
    let capacity = Capacity {
        longest_episode_s: competition().longest_episode_s(),
        slots: 0,
        runtimes: Vec::new(),
        time: config.time.clone(),
    };
    let http_config = resources.http_config(
        &config,
        Clock::new(move || made_at),
        capacity,
        AgentResources::none(),
    );
    let router = faceoff_http::router(store.clone(), LiveState::default(), http_config);
    let season = store.season().await.context("reading the season")?.name;
    tracing::info!(
        %address,
        data_dir = %data_dir.display(),
        season,
        edition = %archived.edition,
        %made_at,
        imported_at = archived.imported_at.map(tracing::field::display),
        "serving an archived season read-only: no schedule, no slots, no sign-in, no changes"
    );
    let shutdown = CancellationToken::new();
    let signal = shutdown_signal()?;
    let mut server = tokio::spawn(serve_http(
        resources.listener,
        router,
        connections,
        shutdown.clone(),
    ));
    print_address(address);
    let outcome = tokio::select! {
        name = signal => {
            tracing::info!(signal = name, "shutting down");
            shutdown.cancel();
            server.await
        }
        outcome = &mut server => outcome,
    };
    outcome.context("the HTTP server panicked")??;
    store.close().await;
    Ok(())
}
