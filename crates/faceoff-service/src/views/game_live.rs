//! A game under way, as far as it was told: for pages that are complete without a stream.

use crate::app::AppState;
use faceoff_store::LiveNews;
use faceoff_types::{GameId, LiveGame, LiveHappening};

/// How a game stands that is being played, and all that happened in it.
#[derive(Debug)]
pub struct GameLive {
    pub stands: LiveGame,
    /// In the order in which it was told.
    pub happenings: Vec<LiveHappening>,
}

impl GameLive {
    /// `None` if no slot of this process plays it, or nothing of it was told yet.
    pub fn of(app: &AppState, game: GameId) -> Option<Self> {
        let mut watch = app.store.live_games().watch(game)?;
        let LiveNews {
            stands, happenings, ..
        } = watch.news(None);
        (!stands.is_over).then_some(Self { stands, happenings })
    }
}
