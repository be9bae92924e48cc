//! Serves an archived season read-only, without schedule and worker slots. Its data folder was created by `faceoff import`.

use super::{
    data_folder::{empty_folder, load_or_create_link_key, lock, set_admin_token},
    http::{serve_http, shutdown_signal},
};
use crate::{config::Config, machine};
use anyhow::Context;
use faceoff_http::{AgentResources, Capacity, ConnectionLimits, HttpConfig};
use faceoff_live::LiveState;
use faceoff_metrics::Metrics;
use faceoff_store::{ArchivedSeason, FreeSpace, Store};
use faceoff_types::Clock;
use jiff::Timestamp;
use std::io::Write as _;
use tokio::net::TcpListener;
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
    let data_dir = config.server.data_dir.clone();
    let _lock = lock(&data_dir)?;
    let upload_dir = data_dir.join("uploads");
    // A process that was killed while a visitor downloaded the archive may have left a temporary file.
    empty_folder(&upload_dir)?;
    let store = Store::open(&data_dir)
        .await
        .with_context(|| format!("opening the data folder {}", data_dir.display()))?
        .with_free_space(FreeSpace::new(
            vec![data_dir.clone()],
            config.server.min_free_bytes,
        ));
    set_admin_token(&store, &data_dir, Timestamp::now()).await?;
    let listener = TcpListener::bind(config.server.listen)
        .await
        .with_context(|| {
            format!(
                "listening on {}; choose another address with --listen",
                config.server.listen
            )
        })?;
    let address = listener.local_addr().context("reading the bound address")?;
    let made_at = archived.made_at;
    let router = faceoff_http::router(
        store.clone(),
        LiveState::default(),
        HttpConfig {
            max_bundle_bytes: config.bundle.packed_bytes,
            public_url: config.server.public_url.clone(),
            upload_dir,
            clock: Clock::new(move || made_at),
            limits: config.uploads.limits(),
            capacity: Capacity {
                slots: 0,
                runtimes: Vec::new(),
                time: config.time.clone(),
            },
            agent_resources: AgentResources::none(),
            rate_limits: config.rates.limits(),
            link_key: load_or_create_link_key(&data_dir)?,
            metrics: Metrics::new(env!("CARGO_PKG_VERSION")),
            process: machine::process,
            webhooks: config.webhooks.clone(),
        },
    );
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
    let mut server = tokio::spawn(serve_http(listener, router, connections, shutdown.clone()));
    let _ = writeln!(std::io::stdout(), "http://{address}");
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
