//! Warns of days that do not fit into their time, in the log.

use faceoff_api::views::capacity::{DayLoad, Fit};
use faceoff_service::{config::Capacity, views::capacity};
use faceoff_store::{Change, Event, Store, StoreError};
use faceoff_types::{Clock, StageDay, StageName};
use std::{collections::BTreeSet, time::Duration};
use tokio::sync::broadcast::error::RecvError;

/// Between two looks without a cut: hours are what the forecast is about.
const INTERVAL: Duration = Duration::from_secs(60);

/// A day that does not fit, by what such episodes took of late.
#[derive(Debug, Clone, PartialEq)]
pub struct Overflow {
    pub stage: StageName,
    /// What of it is to be played, and until when, with a sentence.
    pub load: DayLoad,
}

/// Looks at the forecast of all stages, and remembers which days it found not to fit.
#[derive(Debug)]
pub struct CapacityWatch {
    store: Store,
    clock: Clock,
    capacity: Capacity,
    /// With whether they have had their cut.
    not_fitting: BTreeSet<(StageDay, bool)>,
}

impl CapacityWatch {
    /// One that has looked at nothing yet.
    #[must_use]
    pub const fn new(store: Store, clock: Clock, capacity: Capacity) -> Self {
        Self {
            store,
            clock,
            capacity,
            not_fitting: BTreeSet::new(),
        }
    }

    /// The days that do not fit, and did when it was looked last, or had no cut then. What was never measured is none
    /// of them.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub async fn look(&mut self) -> Result<Vec<Overflow>, StoreError> {
        let now = self.clock.now();
        let (mut new, mut not_fitting) = (Vec::new(), BTreeSet::new());
        for stage in self.store.stages().await? {
            let forecast = capacity::forecast(&self.store, &self.capacity, stage.id, now);
            let overflows = forecast.await?.days.into_iter();
            for load in overflows.filter(|load| load.fit == Fit::Not) {
                let day = StageDay {
                    stage: stage.id,
                    date: load.day,
                };
                let key = (day, load.is_under_way);
                not_fitting.insert(key);
                if !self.not_fitting.contains(&key) {
                    new.push(Overflow {
                        stage: stage.name.clone(),
                        load,
                    });
                }
            }
        }
        self.not_fitting = not_fitting;
        Ok(new)
    }

    /// Writes a line to the log for each day that is found not to fit, looking at each cut and every minute, until
    /// `shutdown` is over.
    pub async fn run(mut self, shutdown: impl Future<Output = ()>) {
        tokio::pin!(shutdown);
        let mut events = self.store.events();
        loop {
            match self.look().await {
                Ok(overflows) => {
                    for Overflow { stage, load } in overflows {
                        tracing::warn!(%stage, day = %load.day, "{}", load.summary);
                    }
                }
                Err(error) => {
                    tracing::debug!(%error, "whether days fit could not be read; looking again");
                }
            }
            let again = tokio::time::sleep(INTERVAL);
            tokio::pin!(again);
            loop {
                tokio::select! {
                    () = &mut shutdown => return,
                    () = &mut again => break,
                    change = events.recv() => match change {
                        Ok(Change::Recorded(record))
                            if matches!(record.event, Event::DayStarted { .. }) => break,
                        // What was missed may have been a cut.
                        Err(RecvError::Lagged(_)) => break,
                        Err(RecvError::Closed) => return,
                        Ok(_) => {}
                    },
                }
            }
        }
    }
}
