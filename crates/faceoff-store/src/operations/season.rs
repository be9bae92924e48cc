//! The season as a whole: its name, its competition, and its closing.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::stage_sign_off::is_final_day_pending,
    store::Store,
    tables::{evaluations, games, season, stages, tournaments},
};
use faceoff_types::Competition;
use jiff::Timestamp;

impl Store {
    /// Renames the season. An event is recorded only if the name changes.
    #[boxed_future]
    pub async fn name_season(&self, actor: Actor, name: &str, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            if season::rename(tx, name).await? {
                let name = name.to_owned();
                tx.record(Subject::Season, Event::SeasonNamed { name });
            }
            Ok(())
        })
        .await
    }

    /// Binds the season to the competition of the server, which is about to show it and to run its jobs. The hash covers what scores
    /// depend on; a newer version of the program may have another. [`StoreError::Conflict`] if the season belongs to another
    /// competition.
    #[boxed_future]
    pub async fn bind_competition(&self, competition: &Competition, now: Timestamp) -> Result<()> {
        let hash = competition.hash();
        let bound = season::competition(&mut *self.database.read.acquire().await?).await?;
        match bound {
            Some((id, _)) if id != competition.id => Err(StoreError::Conflict(format!(
                "the season belongs to the competition {id:?}, and this program runs {:?}",
                competition.id
            ))),
            Some((_, bound_hash)) if bound_hash == hash => Ok(()),
            // The hash is not updated in an imported archive, which is read-only.
            _ if self.archived_season().is_some() => Ok(()),
            _ => {
                self.write(Actor::Server, now, async |tx| {
                    season::set_competition(tx, &competition.id, &hash).await
                })
                .await
            }
        }
    }

    /// Closes the season for good: uploads and evaluations end, and its secret becomes public.
    /// [`StoreError::SeasonClosed`] if it is closed already. [`StoreError::Conflict`] while evaluations,
    /// games or a tournament are open, or while a stage is blind or its final day is pending.
    #[boxed_future]
    pub async fn close_season(&self, actor: Actor, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let open_evaluations = evaluations::count_open(tx, None).await?;
            let open_proposed = evaluations::count_open_proposed(tx, None).await?;
            if open_proposed > 0 {
                return StoreError::conflict(format!(
                    "{open_proposed} evaluations of trials and proposed re-evaluations are queued or running: wait until they \
                     are over, or drop them"
                ));
            }
            let open_games = games::count_open(tx).await?;
            if open_games > 0 {
                return StoreError::conflict(format!(
                    "{open_games} games are queued or running, and closing the season publishes their seeds: wait until they \
                     are over, or cancel them"
                ));
            }
            let tournaments = tournaments::all(tx).await?;
            if let Some(open) = tournaments
                .iter()
                .find(|tournament| tournament.closed_at.is_none()) {
                return StoreError::conflict(format!(
                    "the tournament {:?} is not closed, and a closed season has no games: close it first",
                    open.name.as_str()
                ));
            }
            if open_evaluations > 0 {
                return StoreError::conflict(format!(
                    "{open_evaluations} evaluations are queued or running, and closing the season publishes \
                     their seeds: wait until they are over, or cancel them"
                ));
            }
            for stage in stages::all(tx).await? {
                let obstacle = if stage.settings.blind {
                    "is blind (only organisers see its scores), and closing the season publishes the seeds that they follow from: set `blind` to false first"
                } else if is_final_day_pending(tx, &stage).await? {
                    "is decided by a final day that has not been evaluated, and a closed season has no evaluations: start \
                     it first, or let other results count (the stage's `standings`) while it is open"
                } else {
                    continue;
                };
                return StoreError::conflict(format!(
                    "the stage {:?} {obstacle}",
                    stage.name.as_str()
                ));
            }
            season::close(tx, now).await?;
            tx.record(Subject::Season, Event::SeasonClosed);
            Ok(())
        })
        .await
    }
}
