//! The web side of Faceoff: the REST API under `/api/v1` and the server-rendered pages, served together.
//!
//! This crate has the layers around every request, the connections, the probes and the file transfer of remote workers.
//! `faceoff-rest` has the API and `faceoff-pages` the pages. They do not depend on each other; their shared logic is in
//! `faceoff-service`. Clock and configuration are passed in; the environment is never read.

mod capacity_monitor;
mod in_flight;
mod layers;
mod peer;
mod probes;
mod proxies;
mod read_only;
mod serve;
mod unread_body;
mod worker_files;

pub use axum::Router;
pub use capacity_monitor::{CapacityMonitor, CapacityWarning};

pub use faceoff_service::{
    agent_resources::{AgentResources, InventoryPublisher},
    config::{Capacity, HttpConfig, HttpLimits},
    download::{Download, DownloadContent, Downloads},
    link_key::LinkKey,
    problem,
    rate_limits::{RateLimit, RateLimits},
    services::partial_uploads::{PARTIAL_UPLOADS_FOLDER, remove_expired as remove_expired_uploads},
    transfer_rate::MinTransferRate,
};
pub use proxies::ProxyNetwork;
pub use serve::{ConnectionLimits, serve};

use axum::middleware;
use faceoff_live::LiveState;
use faceoff_service::app::AppState;
use faceoff_store::Store;
use std::sync::Arc;

/// The whole site: pages at `/`, API under `/api/v1`.
///
/// Every error is a problem document (RFC 9457), also for unknown paths, wrong methods and panics. Browsers get it as a
/// page.
pub fn router(store: Store, live: LiveState, config: HttpConfig) -> Router {
    let timeout = config.limits.request_timeout;
    let app = Arc::new(AppState::new(store, live, config));
    let (api, document) = faceoff_rest::router(timeout, app.config.competition());
    let site = Router::new()
        .merge(api)
        .merge(faceoff_pages::router(&app, timeout, document).layer(
            middleware::from_fn_with_state(Arc::clone(&app), layers::read_consistently),
        ))
        .merge(probes::router(timeout))
        .merge(worker_files::router())
        .fallback(faceoff_pages::path_not_found)
        .method_not_allowed_fallback(faceoff_pages::method_not_allowed)
        .layer(middleware::from_fn_with_state(
            Arc::clone(&app),
            read_only::refuse_changes,
        ))
        .layer(middleware::from_fn_with_state(
            Arc::clone(&app),
            faceoff_pages::identify_viewer,
        ))
        .with_state(Arc::clone(&app));
    layers::wrap(site, &app)
}

/// Metrics, liveness and readiness without a token. For a separate address that only the operators reach, beside
/// [`router`] on the same store and live state.
pub fn monitoring_router(store: Store, live: LiveState, config: HttpConfig) -> Router {
    let timeout = config.limits.request_timeout;
    let app = Arc::new(AppState::new(store, live, config));
    let site = probes::unauthenticated_router(timeout).with_state(Arc::clone(&app));
    layers::wrap(site, &app)
}
