//! The state that all request handlers share: database, configuration, caches and limits.

use crate::{
    aggregated_rows::RowCache, analysis_cache::AnalysisCache, answer_cache::AnswerCache,
    config::HttpConfig, passwords::Passwords, problem::Problem, rate_limits::RequestLimiter,
    summaries::Summaries, tournament_cache::TournamentCache, upload_slots::UploadSlots,
};
use faceoff_api::views::champion_shares::ChampionSharesView;
use faceoff_notify::Feed;
use faceoff_scoring::tournament::rating::Ratings;
use faceoff_store::Store;
use faceoff_types::TokenId;
use std::sync::{Arc, atomic::AtomicBool};
use tokio::sync::Semaphore;
use uuid::Uuid;

/// State of the request handlers.
#[derive(Debug)]
pub struct AppState {
    /// The database and the artifacts, which are its large files: bundles, datasets and recordings.
    pub store: Store,
    /// The server's configuration.
    pub config: HttpConfig,
    /// Limits the concurrent uploads of each team.
    pub upload_slots: Arc<UploadSlots>,
    /// One permit per upload that is being copied into the artifacts.
    pub artifact_writes: Semaphore,
    /// One permit: only one season archive is made and sent at a time.
    pub archive_permit: Arc<Semaphore>,
    /// Episode summaries of runs, from which boards compute their statistics.
    pub summaries: Summaries,
    /// Rows of boards that are aggregated over many days.
    pub row_cache: RowCache,
    /// Responses that are the same for all visitors.
    pub answer_cache: AnswerCache,
    /// Ratings of the submissions of a tournament.
    pub rating_cache: TournamentCache<Ratings>,
    /// Analyses of games.
    pub(crate) analysis_cache: AnalysisCache,
    /// How often each team wins when a tournament is replayed with other seeds.
    pub(crate) champion_share_cache: TournamentCache<ChampionSharesView>,
    /// Whether the season has a tournament; false until this process has seen one. Tournaments are never removed.
    pub has_tournaments: AtomicBool,
    /// One permit per reader of a live game.
    pub live_reader_permits: Arc<Semaphore>,
    /// One permit per reader of the event stream.
    pub event_reader_permits: Arc<Semaphore>,
    /// Source of all event streams.
    pub feed: Feed,
    /// Verifies passwords and counts wrong ones.
    pub passwords: Passwords,
    /// Counts recent requests by address and by token.
    pub request_limiter: RequestLimiter,
    /// Random per process. Part of entity tags (header `ETag`), because the database may be another one after a restart.
    pub process_id: Uuid,
}

/// More copies at once do not make the disk faster, and each keeps files open.
const MAX_ARTIFACT_WRITES: usize = 4;

/// The state as handlers receive it.
pub type App = Arc<AppState>;

impl AppState {
    /// State with empty caches.
    pub fn new(store: Store, config: HttpConfig) -> Self {
        Self {
            upload_slots: Arc::new(UploadSlots::new(config.limits.team_uploads)),
            artifact_writes: Semaphore::new(MAX_ARTIFACT_WRITES),
            archive_permit: Arc::new(Semaphore::new(1)),
            summaries: Summaries::new(store.clone(), config.clock.clone()),
            row_cache: RowCache::new(store.clone()),
            answer_cache: AnswerCache::default(),
            rating_cache: TournamentCache::default(),
            analysis_cache: AnalysisCache::default(),
            champion_share_cache: TournamentCache::default(),
            has_tournaments: AtomicBool::new(false),
            live_reader_permits: Arc::new(Semaphore::new(config.limits.live_readers)),
            event_reader_permits: Arc::new(Semaphore::new(config.limits.event_readers)),
            feed: Feed::new(store.clone()),
            passwords: Passwords::default(),
            request_limiter: RequestLimiter::new(config.rate_limits),
            process_id: Uuid::now_v7(),
            store,
            config,
        }
    }

    /// Counts a request with a token.
    ///
    /// # Errors
    /// [`ProblemKind::TooManyRequests`](crate::problem::ProblemKind::TooManyRequests).
    pub fn check_rate(&self, token: TokenId) -> Result<(), Problem> {
        let checked = self.request_limiter.check_token(token);
        if checked.is_err() {
            self.config.metrics.web().record_refusal("rate");
        }
        checked
    }
}
