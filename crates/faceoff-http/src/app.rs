use crate::{
    config::HttpConfig, kept::Kept, passwords::Passwords, standing::KeptRows, summaries::Summaries,
    uploads::Uploads, views::certainty::CertaintyView,
};
use faceoff_scoring::tournament::rating::Ratings;
use faceoff_store::Store;
use std::sync::Arc;
use tokio::sync::Semaphore;

/// State of the handlers.
#[derive(Debug)]
pub(crate) struct AppState {
    pub(crate) store: Store,
    pub(crate) config: HttpConfig,
    /// Uploads under way.
    pub(crate) uploads: Arc<Uploads>,
    /// One permit per upload that is copied to where it stays.
    pub(crate) storing: Semaphore,
    /// One permit: an archive is made and sent.
    pub(crate) archiving: Arc<Semaphore>,
    pub(crate) summaries: Summaries,
    pub(crate) rows: KeptRows,
    pub(crate) ratings: Kept<Ratings>,
    pub(crate) certainties: Kept<CertaintyView>,
    /// One permit per reader of a game under way.
    pub(crate) watching: Arc<Semaphore>,
    pub(crate) passwords: Passwords,
}

/// The disk is no faster for more of them, and each holds files open.
const STORING: usize = 4;

pub(crate) type App = Arc<AppState>;

impl AppState {
    pub(crate) fn new(store: Store, config: HttpConfig) -> Self {
        Self {
            uploads: Arc::new(Uploads::new(config.limits.team_uploads)),
            storing: Semaphore::new(STORING),
            archiving: Arc::new(Semaphore::new(1)),
            summaries: Summaries::new(store.clone(), config.clock.clone()),
            rows: KeptRows::new(store.clone()),
            ratings: Kept::default(),
            certainties: Kept::default(),
            watching: Arc::new(Semaphore::new(config.limits.live_readers)),
            passwords: Passwords::default(),
            store,
            config,
        }
    }
}
