//! Live updates of a running game: a slot sends them to the server, which shows them to viewers.

use crate::{lease::Progress, server::JobServer};
use faceoff_live::LiveGames;
use faceoff_runner::LiveFeedSink;
use faceoff_types::{GameId, LiveEvent, LivePosition};
use faceoff_wire::{job::Lease, remote::LiveGameUpdate};
use std::sync::Arc;

/// Publishes live updates of a running game, and reports its progress to the lease keeper. The drop publishes the end of the attempt.
pub(crate) struct GameBroadcast {
    server: Arc<dyn JobServer>,
    lease: Lease,
    game: GameId,
    attempt: u32,
    progress: Progress,
}

impl GameBroadcast {
    pub(crate) fn begin(
        server: Arc<dyn JobServer>,
        lease: Lease,
        (game, attempt): (GameId, u32),
        steps: u32,
        progress: Progress,
    ) -> Self {
        let broadcast = Self {
            server,
            lease,
            game,
            attempt,
            progress,
        };
        broadcast.publish(LiveGameUpdate::Started { steps });
        broadcast
    }

    pub(crate) const fn progress(&self) -> &Progress {
        &self.progress
    }

    fn publish(&self, update: LiveGameUpdate) {
        self.server
            .publish_game(&self.lease, (self.game, self.attempt), update);
    }
}

impl LiveFeedSink for GameBroadcast {
    fn receive(&mut self, events: Vec<LiveEvent>, position: LivePosition) {
        self.progress.game_stepped(position.step);
        self.publish(LiveGameUpdate::Progress { events, position });
    }

    fn cancelled(&self) -> bool {
        self.progress.must_stop()
    }
}

/// Ends the broadcast, even if a panic ends the game.
impl Drop for GameBroadcast {
    fn drop(&mut self) {
        self.publish(LiveGameUpdate::Ended);
    }
}

/// Shows viewers a live update of an attempt, given as the game's id and the number of the attempt.
pub(crate) fn show_update(
    games: &LiveGames,
    (game, attempt): (GameId, u32),
    update: LiveGameUpdate,
) {
    match update {
        LiveGameUpdate::Started { steps } => games.begin(game, attempt, steps),
        LiveGameUpdate::Progress { events, position } => {
            games.advance(game, attempt, events, Some(position));
        }
        LiveGameUpdate::Ended => games.end_attempt(game, attempt),
    }
}
