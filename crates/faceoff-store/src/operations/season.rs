use crate::{
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{drafts, evaluations, season, stages},
};
use jiff::Timestamp;

impl Store {
    /// Names the season. Its name before is no event.
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

    /// Closes the season for good: nothing more is uploaded or evaluated, and its secret is public.
    /// [`StoreError::SeasonClosed`] if it is closed already, [`StoreError::Conflict`] while
    /// evaluations are under way or a stage is blind.
    pub async fn close_season(&self, actor: Actor, now: Timestamp) -> Result<()> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let under_way = evaluations::count_open(tx, None).await?;
            let proposed = drafts::count_open(tx, None).await?;
            if proposed > 0 {
                return Err(StoreError::Conflict(format!(
                    "{proposed} evaluations of trials and proposals are queued or running: wait until they are over, \
                     or drop them"
                )));
            }
            if under_way > 0 {
                return Err(StoreError::Conflict(format!(
                    "{under_way} evaluations are queued or running, and closing the season publishes \
                     their seeds: wait until they are over, or cancel them"
                )));
            }
            let mut stages = stages::all(tx).await?.into_iter();
            if let Some(blind) = stages.find(|stage| stage.settings.blind) {
                return Err(StoreError::Conflict(format!(
                    "the stage {:?} is blind, and closing the season publishes the seeds that its scores follow \
                     from: open it first",
                    blind.name.as_str()
                )));
            }
            season::close(tx, now).await?;
            tx.record(Subject::Season, Event::SeasonClosed);
            Ok(())
        })
        .await
    }
}
