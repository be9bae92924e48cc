use crate::{config::HttpConfig, summaries::Summaries};
use faceoff_store::Store;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// State of the handlers.
#[derive(Debug)]
pub(crate) struct AppState {
    pub(crate) store: Store,
    pub(crate) config: HttpConfig,
    /// One permit per upload under way.
    pub(crate) uploads: Semaphore,
    pub(crate) summaries: Summaries,
}

pub(crate) type App = Arc<AppState>;

impl AppState {
    pub(crate) fn new(store: Store, config: HttpConfig) -> Self {
        Self {
            uploads: Semaphore::new(config.limits.uploads),
            summaries: Summaries::new(store.clone(), config.clock.clone()),
            store,
            config,
        }
    }
}
