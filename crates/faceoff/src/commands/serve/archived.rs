//! Showing a season that stands still: requests, and nothing else.

use super::{
    answering::{answer, signalled},
    folder::{claim, empty_folder, link_key, set_admin_token},
};
use crate::{config::Config, machine};
use anyhow::Context;
use faceoff_http::{Capacity, ConnectionLimits, HttpConfig, Offer};
use faceoff_metrics::Metrics;
use faceoff_store::{Archived, Room, Store};
use faceoff_types::Clock;
use jiff::Timestamp;
use std::io::Write as _;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

/// Serves an archive's season until SIGINT or SIGTERM, at the moment that it shows: no schedule, no slots, no change.
///
/// # Errors
/// If the data folder or the address is not as it must be.
pub async fn serve(
    config: Config,
    connections: ConnectionLimits,
    archived: Archived,
) -> anyhow::Result<()> {
    let data_dir = config.server.data_dir.clone();
    let _claimed = claim(&data_dir)?;
    let upload_dir = data_dir.join("uploads");
    // What a kill has left of an archive that was being made of it.
    empty_folder(&upload_dir)?;
    let store = Store::open(&data_dir)
        .await
        .with_context(|| format!("opening the data folder {}", data_dir.display()))?
        .with_room(Room::new(
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
    let address = listener
        .local_addr()
        .context("asking for the address that was bound")?;
    let made_at = archived.made_at;
    let router = faceoff_http::router(
        store.clone(),
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
            offer: Offer::nothing(),
            rates: config.rates.limits(),
            link_key: link_key(&data_dir)?,
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
        "showing an archived season, read-only: no schedule, no slots, no sign-in, and no change"
    );
    let shutdown = CancellationToken::new();
    let signal = signalled()?;
    let mut answering = tokio::spawn(answer(listener, router, connections, shutdown.clone()));
    let _ = writeln!(std::io::stdout(), "http://{address}");
    let answered = tokio::select! {
        name = signal => {
            tracing::info!(signal = name, "ending");
            shutdown.cancel();
            answering.await
        }
        answered = &mut answering => answered,
    };
    answered.context("the answering part panicked")??;
    store.close().await;
    Ok(())
}
