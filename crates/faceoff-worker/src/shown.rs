use crate::{
    lease::Progress,
    server::{GameShow, WorkServer},
};
use faceoff_runner::GameAudience;
use faceoff_types::{GameId, LiveHappening, LivePosition};
use faceoff_wire::work::Lease;
use std::sync::Arc;

/// Shows a game under way to the server, and its progress to the lease's keeper, until it is dropped.
pub(crate) struct Shown {
    server: Arc<dyn WorkServer>,
    lease: Lease,
    game: GameId,
    attempt: u32,
    progress: Progress,
}

impl Shown {
    pub(crate) fn begin(
        server: Arc<dyn WorkServer>,
        lease: Lease,
        (game, attempt): (GameId, u32),
        steps: u32,
        progress: Progress,
    ) -> Self {
        let shown = Self {
            server,
            lease,
            game,
            attempt,
            progress,
        };
        shown.show(GameShow::Begun { steps });
        shown
    }

    pub(crate) const fn progress(&self) -> &Progress {
        &self.progress
    }

    fn show(&self, show: GameShow) {
        self.server
            .show(&self.lease, (self.game, self.attempt), show);
    }
}

impl GameAudience for Shown {
    fn hear(&mut self, happenings: Vec<LiveHappening>, position: LivePosition) {
        self.progress.game_stepped(position.step);
        self.show(GameShow::Goes {
            happenings,
            position,
        });
    }

    fn cancelled(&self) -> bool {
        self.progress.stopped()
    }
}

/// Also when a panic ends the game.
impl Drop for Shown {
    fn drop(&mut self) {
        self.show(GameShow::Over);
    }
}
