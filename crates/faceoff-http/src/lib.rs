//! The web side of Faceoff: the REST API under `/api/v1` and the server-rendered pages.
//!
//! It streams uploads to disk, checks tokens and shows what the store holds. It unpacks no bundle,
//! runs no agent and computes no score: those are the workers' and `faceoff-scoring`'s. It reads no
//! clock and no environment that it was not given.
//!
//! [`views`] are what can be known of a resource; API and pages both show them, and know nothing of
//! each other.

mod acts;
mod api;
mod app;
mod archive;
mod archived;
mod auth;
mod capacity_watch;
mod conditions;
mod config;
mod csv;
mod ending;
mod episode_path;
mod event_reader;
mod extract;
mod form_file;
mod in_flight;
mod kept;
mod kept_analyses;
mod kept_answers;
mod layers;
mod link_key;
mod links;
mod live_reader;
mod network;
mod offer;
mod pace;
mod pages;
mod paging;
mod passwords;
mod paths;
mod peer;
mod probes;
pub mod problem;
mod query;
mod rates;
mod release;
pub mod requests;
mod room;
mod serve;
mod session;
mod standing;
mod summaries;
mod text;
pub mod token;
mod uploads;
mod viewer;
pub mod views;
mod watched;
mod work_files;

pub use axum::Router;
pub use capacity_watch::{CapacityWatch, Overflow};
pub use config::{Capacity, HttpConfig, HttpLimits};
pub use link_key::LinkKey;
pub use offer::{InventoryTeller, Offer};
pub use pace::LeastRate;
pub use paths::API_BASE;
pub use rates::{Rate, RateLimits};
pub use serve::{ConnectionLimits, serve};

use app::AppState;
use axum::middleware;
use faceoff_store::Store;
use std::sync::Arc;

/// The whole site: pages at `/`, API under `/api/v1`.
///
/// Every error is a problem (RFC 9457), unknown paths, wrong methods and panics included; browsers
/// get the same as a page.
pub fn router(store: Store, config: HttpConfig) -> Router {
    let patience = config.limits.answer;
    let app = Arc::new(AppState::new(store, config));
    let (api, document) = api::router(patience);
    let site = Router::new()
        .merge(api)
        .merge(pages::router(patience, document))
        .merge(probes::router(patience))
        .merge(work_files::router())
        .fallback(pages::unknown_path)
        .method_not_allowed_fallback(pages::unknown_method)
        .layer(middleware::from_fn_with_state(
            Arc::clone(&app),
            archived::refuse_changes,
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
