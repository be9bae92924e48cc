//! What handlers share.

use crate::{
    config::HttpConfig, kept::Kept, kept_analyses::KeptAnalyses, kept_answers::KeptAnswers,
    passwords::Passwords, problem::Problem, rates::Rates, standing::KeptRows, summaries::Summaries,
    uploads::Uploads,
};
use faceoff_api::views::certainty::CertaintyView;
use faceoff_notify::Feed;
use faceoff_scoring::tournament::rating::Ratings;
use faceoff_store::Store;
use faceoff_types::TokenId;
use std::sync::{Arc, atomic::AtomicBool};
use tokio::sync::Semaphore;
use uuid::Uuid;

/// State of the handlers.
#[derive(Debug)]
pub struct AppState {
    /// The database and the artifacts.
    pub store: Store,
    /// As the server was configured.
    pub config: HttpConfig,
    pub uploads: Arc<Uploads>,
    /// One permit per upload that is copied to where it stays.
    pub storing: Semaphore,
    /// One permit: an archive is made and sent.
    pub archiving: Arc<Semaphore>,
    /// Summaries of runs that boards have asked for.
    pub summaries: Summaries,
    /// Rows of boards that are chosen among many days.
    pub rows: KeptRows,
    pub kept_answers: KeptAnswers,
    pub ratings: Kept<Ratings>,
    pub(crate) kept_analyses: KeptAnalyses,
    pub(crate) certainties: Kept<CertaintyView>,
    /// Is it known that the season has a tournament? None is ever removed.
    pub has_tournaments: AtomicBool,
    /// One permit per reader of a game under way.
    pub watching: Arc<Semaphore>,
    /// One permit per reader of the stream of events.
    pub following: Arc<Semaphore>,
    /// What all of them read.
    pub feed: Feed,
    /// Checks passwords, and counts wrong ones.
    pub passwords: Passwords,
    /// Who has asked how often of late.
    pub rates: Rates,
    /// Of this process alone: what was tagged before a restart may have been of another database.
    pub run: Uuid,
}

/// The disk is no faster for more of them, and each holds files open.
const STORING: usize = 4;

/// The state as handlers get it.
pub type App = Arc<AppState>;

impl AppState {
    /// On a store, with nothing kept yet.
    pub fn new(store: Store, config: HttpConfig) -> Self {
        Self {
            uploads: Arc::new(Uploads::new(config.limits.team_uploads)),
            storing: Semaphore::new(STORING),
            archiving: Arc::new(Semaphore::new(1)),
            summaries: Summaries::new(store.clone(), config.clock.clone()),
            rows: KeptRows::new(store.clone()),
            kept_answers: KeptAnswers::default(),
            ratings: Kept::default(),
            kept_analyses: KeptAnalyses::default(),
            certainties: Kept::default(),
            has_tournaments: AtomicBool::new(false),
            watching: Arc::new(Semaphore::new(config.limits.live_readers)),
            following: Arc::new(Semaphore::new(config.limits.event_readers)),
            feed: Feed::new(store.clone()),
            passwords: Passwords::default(),
            rates: Rates::new(config.rates),
            run: Uuid::now_v7(),
            store,
            config,
        }
    }

    /// Counts a request with a token.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`](crate::problem::ProblemKind::TooManyRequests).
    pub fn check_rate(&self, token: TokenId) -> Result<(), Problem> {
        let checked = self.rates.check_token(token);
        if checked.is_err() {
            self.config.metrics.web().refused("rate");
        }
        checked
    }
}
