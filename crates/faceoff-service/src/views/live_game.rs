//! The current state of a running game, for pages that do not read the stream of live events.

use crate::app::AppState;
use faceoff_live::LiveUpdate;
use faceoff_types::{GameId, LiveEvent, LiveGame};

/// State of a running game, and everything that has happened in it.
#[derive(Debug)]
pub struct LiveGameView {
    pub state: LiveGame,
    /// In chronological order.
    pub events: Vec<LiveEvent>,
}

impl LiveGameView {
    /// The current state of a game; `None` if the game is not running, or the slot that plays it does not report to this process.
    pub fn find(app: &AppState, game: GameId) -> Option<Self> {
        let mut subscription = app.live.games.subscribe(game)?;
        let LiveUpdate { state, events, .. } = subscription.read_since(None);
        (!state.is_over).then_some(Self { state, events })
    }
}
