//! The current state of a live game, for pages that do not use the stream.

use crate::app::AppState;
use faceoff_store::LiveUpdate;
use faceoff_types::{GameId, LiveEvent, LiveGame};

/// State of a running game, and everything that has happened in it.
#[derive(Debug)]
pub struct LiveGameView {
    pub state: LiveGame,
    /// In chronological order.
    pub events: Vec<LiveEvent>,
}

impl LiveGameView {
    /// `None` if no slot reports it to this process, or it has not started yet.
    pub fn find(app: &AppState, game: GameId) -> Option<Self> {
        let mut subscription = app.store.live_games().subscribe(game)?;
        let LiveUpdate { state, events, .. } = subscription.read_since(None);
        (!state.is_over).then_some(Self { state, events })
    }
}
