//! The web side of Faceoff: the REST API under `/api/v1` and the server-rendered pages.
//!
//! It streams uploads to disk, checks tokens and shows what the store holds. It unpacks no bundle,
//! runs no agent and computes no score: those are the workers' and `faceoff-scoring`'s. It reads no
//! clock and no environment that it was not given.

pub mod api;
mod auth;
mod extract;
mod layers;
mod pages;
pub mod problem;
mod seeds;
mod summaries;
pub mod token;

pub use axum::Router;
use faceoff_store::{RunPlan, Store};
use faceoff_types::Clock;
use jiff::civil;
use std::{io, path::PathBuf, sync::Arc, time::Duration};
use tokio::{net::TcpListener, sync::Semaphore};

/// How much the web side takes on at a time, and how long it waits.
#[derive(Debug, Clone, Copy)]
pub struct HttpLimits {
    /// Requests being answered at the same time; more are told to come back.
    pub requests: usize,
    /// Uploads at the same time; each one writes to disk.
    pub uploads: usize,
    /// Longest time to answer a request that is no upload.
    pub answer: Duration,
    /// Longest pause inside an upload.
    pub upload_pause: Duration,
    /// Uploads of one team that may wait for their smoke run.
    pub pending_submissions: usize,
}

impl Default for HttpLimits {
    fn default() -> Self {
        Self {
            requests: 512,
            uploads: 16,
            answer: Duration::from_secs(30),
            upload_pause: Duration::from_secs(30),
            pending_submissions: 5,
        }
    }
}

/// What [`router`] needs besides the store.
#[derive(Debug, Clone)]
pub struct HttpConfig {
    /// Largest packed bundle, in bytes.
    pub max_bundle_bytes: u64,
    /// How an evaluation runs: of a team's own turn, and of `POST /api/v1/days` where its body does
    /// not say otherwise.
    pub plan: RunPlan,
    /// BLAKE3 of the organiser's bearer token ([`token::hash_token`]).
    pub admin_token_hash: [u8; 32],
    /// Existing folder for uploads under way, on a disk with room for some bundles.
    pub upload_dir: PathBuf,
    /// UTC time of the daily evaluation; `None` when the organiser starts it by hand. Shown only.
    pub daily_at: Option<civil::Time>,
    /// The time.
    pub clock: Clock,
    /// Concurrency and patience.
    pub limits: HttpLimits,
}

/// State of the handlers.
#[derive(Debug)]
struct AppState {
    store: Store,
    config: HttpConfig,
    uploads: Arc<Semaphore>,
    summaries: summaries::SummaryCache,
}

type App = Arc<AppState>;

/// The whole site: pages at `/`, API under `/api/v1`.
///
/// Every error is a problem (RFC 9457), unknown paths, wrong methods and panics included; browsers
/// get the same as a page.
pub fn router(store: Store, config: HttpConfig) -> Router {
    let limits = config.limits;
    let uploads = Arc::new(Semaphore::new(limits.uploads));
    let app: App = Arc::new(AppState {
        store,
        config,
        uploads,
        summaries: summaries::SummaryCache::default(),
    });
    let site = Router::new()
        .merge(api::router(limits.answer))
        .merge(pages::router(limits.answer))
        .fallback(pages::unknown_path)
        .method_not_allowed_fallback(pages::unknown_method)
        .with_state(app);
    layers::around(site, limits.requests)
}

/// Answers requests until `until` ends, and after that the ones that are under way.
///
/// # Errors
/// The listener failed.
pub async fn serve(
    listener: TcpListener,
    router: Router,
    until: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    axum::serve(listener, router)
        .with_graceful_shutdown(until)
        .await
}
