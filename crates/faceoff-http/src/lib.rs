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
mod auth;
mod config;
mod extract;
mod freeze;
mod layers;
mod pace;
mod pages;
mod passwords;
mod paths;
pub mod problem;
mod release;
pub mod requests;
mod room;
mod serve;
mod session;
mod summaries;
mod text;
pub mod token;
mod uploads;
mod viewer;
pub mod views;

pub use axum::Router;
pub use config::{Capacity, HttpConfig, HttpLimits};
pub use pace::LeastRate;
pub use paths::API_BASE;
pub use serve::{ConnectionLimits, serve};

use app::AppState;
use faceoff_store::Store;
use std::sync::Arc;

/// The whole site: pages at `/`, API under `/api/v1`.
///
/// Every error is a problem (RFC 9457), unknown paths, wrong methods and panics included; browsers
/// get the same as a page.
pub fn router(store: Store, config: HttpConfig) -> Router {
    let limits = config.limits;
    let site = Router::new()
        .merge(api::router(limits.answer))
        .merge(pages::router(limits.answer))
        .fallback(pages::unknown_path)
        .method_not_allowed_fallback(pages::unknown_method)
        .with_state(Arc::new(AppState::new(store, config)));
    layers::around(site, limits.requests)
}
