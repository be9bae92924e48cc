use crate::{
    config::HttpConfig, kept::Kept, kept_analyses::KeptAnalyses, kept_answers::KeptAnswers,
    passwords::Passwords, problem::Problem, rates::Rates, standing::KeptRows, summaries::Summaries,
    uploads::Uploads, views::certainty::CertaintyView,
};
use faceoff_notify::Feed;
use faceoff_scoring::tournament::rating::Ratings;
use faceoff_store::Store;
use faceoff_types::TokenId;
use std::sync::{Arc, atomic::AtomicBool};
use tokio::sync::Semaphore;
use uuid::Uuid;

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
    pub(crate) kept_answers: KeptAnswers,
    pub(crate) ratings: Kept<Ratings>,
    pub(crate) kept_analyses: KeptAnalyses,
    pub(crate) certainties: Kept<CertaintyView>,
    /// Is it known that the season has a tournament? None is ever removed.
    pub(crate) has_tournaments: AtomicBool,
    /// One permit per reader of a game under way.
    pub(crate) watching: Arc<Semaphore>,
    /// One permit per reader of the stream of events.
    pub(crate) following: Arc<Semaphore>,
    /// What all of them read.
    pub(crate) feed: Feed,
    pub(crate) passwords: Passwords,
    pub(crate) rates: Rates,
    /// Of this process alone: what was tagged before a restart may have been of another database.
    pub(crate) run: Uuid,
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
    pub(crate) fn check_rate(&self, token: TokenId) -> Result<(), Problem> {
        let checked = self.rates.check_token(token);
        if checked.is_err() {
            self.config.metrics.web().refused("rate");
        }
        checked
    }
}
