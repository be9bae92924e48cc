//! The web side of Faceoff: the REST API under `/api/v1` and the server-rendered pages, served together.
//!
//! What surrounds every request is here, with the connections, the probes and the files for workers elsewhere. The API is
//! `faceoff-rest`, the pages are `faceoff-pages`, which know nothing of each other, and what both do is
//! `faceoff-service`. It reads no clock and no environment that it was not given.

mod capacity_watch;
mod in_flight;
mod layers;
mod peer;
mod probes;
mod read_only;
mod serve;
mod work_files;

pub use axum::Router;
pub use capacity_watch::{CapacityWatch, Overflow};

pub use faceoff_service::{
    config::{Capacity, HttpConfig, HttpLimits},
    link_key::LinkKey,
    offer::{InventoryTeller, Offer},
    pace::LeastRate,
    problem,
    rates::{Rate, RateLimits},
};
pub use serve::{ConnectionLimits, serve};

use axum::middleware;
use faceoff_service::app::AppState;
use faceoff_store::Store;
use std::sync::Arc;

/// The whole site: pages at `/`, API under `/api/v1`.
///
/// Every error is a problem (RFC 9457), unknown paths, wrong methods and panics included; browsers
/// get the same as a page.
pub fn router(store: Store, config: HttpConfig) -> Router {
    let patience = config.limits.answer;
    let app = Arc::new(AppState::new(store, config));
    let (api, document) = faceoff_rest::router(patience);
    let site = Router::new()
        .merge(api)
        .merge(faceoff_pages::router(patience, document))
        .merge(probes::router(patience))
        .merge(work_files::router())
        .fallback(faceoff_pages::unknown_path)
        .method_not_allowed_fallback(faceoff_pages::unknown_method)
        .layer(middleware::from_fn_with_state(
            Arc::clone(&app),
            read_only::refuse_changes,
        ))
        .with_state(Arc::clone(&app));
    layers::around(site, &app)
}

/// What watches the server finds it here without a token: numbers, and whether it lives and is ready. For an address of its
/// own that strangers do not reach, beside [`router`] on the same store.
pub fn watching_router(store: Store, config: HttpConfig) -> Router {
    let patience = config.limits.answer;
    let app = Arc::new(AppState::new(store, config));
    let site = probes::open_router(patience).with_state(Arc::clone(&app));
    layers::around(site, &app)
}
