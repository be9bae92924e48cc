//! The state that all request handlers share: database, configuration, caches and limits.

use crate::{
    aggregated_rows::{AggregatedRow, RowsKey},
    answer_cache::{self, AnswerCache},
    change_quota::ChangeQuota,
    config::HttpConfig,
    credential,
    highlight::Highlight,
    network::Network,
    partial_uploads::PartialUploads,
    passwords::Passwords,
    priority_permits::{Precedence, PriorityPermits},
    problem::Problem,
    rate_limits::{RequestLimiter, RequestSource},
    recent_callers::RecentCallers,
    shared_cache::SharedCache,
    summaries::Summaries,
    upload_slots::UploadSlots,
};
use axum::http::HeaderMap;
use faceoff_api::views::champion_shares::ChampionSharesView;
use faceoff_live::LiveState;
use faceoff_notify::Feed;
use faceoff_replay::GameAnalysis;
use faceoff_scoring::tournament::rating::Ratings;
use faceoff_store::Store;
use faceoff_types::{TokenId, TournamentId};
use faceoff_wire::grant::Grant;
use std::sync::{Arc, atomic::AtomicBool};
use tokio::sync::Semaphore;
use uuid::Uuid;

/// State of the request handlers.
#[derive(Debug)]
pub struct AppState {
    /// The database and the artifacts, which are its large files: bundles, datasets and recordings.
    pub store: Store,
    /// Running games and remote workers.
    pub live: LiveState,
    /// The server's configuration.
    pub config: HttpConfig,
    /// Limits the concurrent uploads of each team.
    pub upload_slots: Arc<UploadSlots>,
    /// The uploads in parts that are being received.
    pub(crate) partial_uploads: Arc<PartialUploads>,
    /// One permit per upload that is being copied into the artifacts.
    pub artifact_writes: Semaphore,
    /// One permit: only one season archive is made and sent at a time.
    pub archive_permit: Arc<Semaphore>,
    /// Episode summaries of runs, from which boards compute their statistics.
    pub summaries: Summaries,
    /// Rows of boards that are aggregated over many days.
    pub(crate) board_rows: SharedCache<RowsKey, Vec<AggregatedRow>>,
    /// Responses that are the same for all visitors.
    pub answer_cache: AnswerCache,
    /// Number of pending decisions of the organisers, which the navigation of their pages shows.
    pub pending_decisions: PendingDecisionsCache,
    /// Ratings of the submissions of a tournament.
    pub(crate) ratings: TournamentAnswers<Ratings>,
    /// Analyses of games by the artifact key of the game's clips, which never change.
    pub(crate) game_analyses: SharedCache<String, GameAnalysis>,
    /// Highlights of evaluations by the artifact key of their clips, which never change; `None`: no success.
    pub(crate) highlights: SharedCache<String, Option<Highlight>>,
    /// Link preview images (Open Graph; *cards*), as PNG, by the hash of their drawing.
    pub card_pictures: SharedCache<String, Vec<u8>>,
    /// One permit: only one such picture is drawn at a time, because the slots that run evaluations and games need the CPUs.
    pub card_drawing_permit: Arc<Semaphore>,
    /// A permit for each request that draws such a picture or waits for that; further ones are refused.
    pub card_request_permits: Arc<Semaphore>,
    /// How often each team wins when a tournament is replayed with other seeds.
    pub(crate) champion_shares: TournamentAnswers<ChampionSharesView>,
    /// One permit: only one answer about a tournament is computed at a time, because the slots that run evaluations and games
    /// need the CPUs.
    tournament_computation: Semaphore,
    /// Whether the season has a tournament; false until this process has seen one. Tournaments are never removed.
    pub has_tournaments: AtomicBool,
    /// Readers of live games.
    pub live_readers: PriorityPermits,
    /// Readers of the event stream.
    pub event_readers: PriorityPermits,
    /// Source of all event streams.
    pub feed: Feed,
    /// Verifies passwords and counts wrong ones.
    pub passwords: Passwords,
    /// Counts recent requests by address and by token.
    pub request_limiter: RequestLimiter,
    /// Changes per team and day.
    pub change_quota: ChangeQuota,
    /// Whose tokens were verified recently.
    pub(crate) recent_callers: RecentCallers,
    /// Random per process. Part of entity tags (header `ETag`), because the database may be another one after a restart.
    pub process_id: Uuid,
}

/// More copies at once do not make the disk faster, and each keeps files open.
const MAX_ARTIFACT_WRITES: usize = 4;

/// Boards in memory. A season has some stages, each with a few revisions of its rules, and each revision has four boards: one
/// for all tasks together and one per task.
const MAX_BOARDS: u64 = 100;

/// Tournaments with answers in memory; a season has a few.
const MAX_TOURNAMENTS: u64 = 20;

/// Highlights in memory, some ten kilobytes each: of the first teams of some boards.
const MAX_HIGHLIGHTS: u64 = 20;

/// Size of the analyses in memory. Most have some ten kilobytes; those of a robot that violates a limit again and again have
/// some hundred.
const MAX_ANALYSIS_BYTES: u64 = 16 << 20;

/// Size of the pictures of cards in memory; each has some 50 kilobytes.
const MAX_CARD_BYTES: u64 = 8 << 20;
/// Requests that draw a picture of a card or wait for that at the same time.
const MAX_WAITING_CARDS: usize = 16;

/// A number of pending decisions by the number of changes of the season and the current minute: stages close without a change.
pub type PendingDecisionsCache = SharedCache<(u64, i64), usize>;

/// Answers about a tournament by the newest change of the season that they include.
type TournamentAnswers<T> = SharedCache<(i64, TournamentId), T>;

/// The state as handlers receive it.
pub type App = Arc<AppState>;

impl AppState {
    /// State with empty caches.
    pub fn new(store: Store, live: LiveState, config: HttpConfig) -> Self {
        Self {
            upload_slots: Arc::new(UploadSlots::new(config.limits.team_uploads)),
            partial_uploads: Arc::default(),
            artifact_writes: Semaphore::new(MAX_ARTIFACT_WRITES),
            archive_permit: Arc::new(Semaphore::new(1)),
            summaries: Summaries::new(store.clone(), Arc::clone(config.competition())),
            board_rows: SharedCache::with_entries(MAX_BOARDS),
            answer_cache: answer_cache::new(),
            pending_decisions: SharedCache::with_entries(1),
            ratings: SharedCache::with_entries(MAX_TOURNAMENTS),
            game_analyses: SharedCache::with_bytes(MAX_ANALYSIS_BYTES, GameAnalysis::memory_bytes),
            highlights: SharedCache::with_entries(MAX_HIGHLIGHTS),
            card_pictures: SharedCache::with_bytes(MAX_CARD_BYTES, Vec::len),
            card_drawing_permit: Arc::new(Semaphore::new(1)),
            card_request_permits: Arc::new(Semaphore::new(MAX_WAITING_CARDS)),
            champion_shares: SharedCache::with_entries(MAX_TOURNAMENTS),
            tournament_computation: Semaphore::new(1),
            has_tournaments: AtomicBool::new(false),
            live_readers: PriorityPermits::new(config.limits.live_readers),
            event_readers: PriorityPermits::new(config.limits.event_readers),
            feed: Feed::new(store.clone()),
            passwords: Passwords::default(),
            request_limiter: RequestLimiter::new(config.rate_limits),
            change_quota: ChangeQuota::new(config.rate_limits.team_changes_per_day),
            recent_callers: RecentCallers::default(),
            process_id: Uuid::now_v7(),
            store,
            live,
            config,
        }
    }

    /// The answer about a tournament that includes the newest change; `compute` computes it.
    pub(crate) async fn tournament_answer<T: Send + Sync + 'static>(
        &self,
        answers: &TournamentAnswers<T>,
        tournament: TournamentId,
        compute: impl Future<Output = Result<T, Problem>> + Send,
    ) -> Result<Arc<T>, Problem> {
        let key = (self.store.newest_change().await?, tournament);
        if let Some(answer) = answers.cached(&key).await {
            return Ok(answer);
        }
        let _permit = self.tournament_computation.acquire().await;
        // The key is read again after the wait, so that all waiting requests share one computation, and before the computation, which
        // may then include a later change.
        let key = (self.store.newest_change().await?, tournament);
        answers
            .get(key, async { compute.await.map(Arc::new) })
            .await
    }

    /// The priority of a request under overload. It gives no rights, so it is found without reading the database: a request with a token
    /// that was not verified recently counts as a visitor's.
    pub fn precedence(&self, headers: &HeaderMap) -> Precedence {
        // With the grant of a job a remote worker transfers the files of that job.
        if let Some(sealed) = credential::sealed_grant(headers)
            && Grant::open(sealed, &self.config.link_key.grant_key()).is_some()
        {
            return Precedence::Team;
        }
        let hash = credential::secret_hash(&self.config, headers);
        let caller = hash.and_then(|hash| self.recent_callers.find(&hash));
        caller.map_or(Precedence::Visitor, |caller| caller.precedence)
    }

    /// Whose requests this one is counted with: the caller's if the token was verified recently, else those of its address.
    pub fn request_source(&self, headers: &HeaderMap, network: Network) -> RequestSource {
        credential::secret_hash(&self.config, headers)
            .and_then(|hash| self.recent_callers.find(&hash))
            .map_or(RequestSource::Network(network), |caller| {
                RequestSource::Caller(caller.owner)
            })
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
