//! Closing of a tournament, after which its results are final.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        games,
        tournaments::{self, Tournament},
    },
};
use faceoff_types::TournamentId;
use jiff::Timestamp;

impl Store {
    /// Closes a tournament for good. [`StoreError::Conflict`] while a game is open, or a game of a round between two
    /// remaining entrants has no result.
    #[boxed_future]
    pub async fn close_tournament(
        &self,
        actor: Actor,
        id: TournamentId,
        now: Timestamp,
    ) -> Result<Tournament> {
        self.write(actor, now, async |tx| {
            let mut tournament = tournaments::find_open(tx, id).await?;
            let open = games::unfinished(tx, id).await?.len();
            if open > 0 {
                return StoreError::conflict(format!(
                    "{open} games are queued or running: wait for their end, or cancel those that do not count"
                ));
            }
            if let Some(pending) = games::pending_of_rounds(tx, id).await?.first() {
                return StoreError::conflict(format!(
                    "game {} has no result: play it again, or let one of its teams leave",
                    pending.game
                ));
            }
            tournament.closed_at = Some(now);
            tournaments::update(tx, &tournament).await?;
            tx.record(Subject::Tournament(id), Event::TournamentClosed);
            Ok(tournament)
        })
        .await
    }
}
