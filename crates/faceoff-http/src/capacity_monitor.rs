//! Logs a warning for each evaluation day that will not finish before its deadline. An evaluation day is all evaluations
//! of one *cutoff*, the moment at which each team's active submission is fixed.

use faceoff_api::views::capacity::{DayLoad, Fit};
use faceoff_live::Workers;
use faceoff_service::{config::Capacity, views::capacity};
use faceoff_store::{Change, Event, Store, StoreError};
use faceoff_types::{Clock, StageDay, StageName};
use std::{collections::BTreeSet, time::Duration};
use tokio::sync::broadcast::error::RecvError;

/// Time until the next check if no cutoff comes first. The forecast is in hours, so once a minute is often enough.
const CHECK_INTERVAL: Duration = Duration::from_secs(60);

/// An evaluation day that will not finish before its deadline, according to the recent durations of its tasks' episodes.
#[derive(Debug, Clone, PartialEq)]
pub struct CapacityWarning {
    pub stage: StageName,
    /// The number of episodes that are left, the deadline, and a sentence about both.
    pub load: DayLoad,
}

/// Checks the forecast of all stages, and remembers which days did not fit, so that it warns once of each.
#[derive(Debug)]
pub struct CapacityMonitor {
    store: Store,
    workers: Workers,
    clock: Clock,
    capacity: Capacity,
    /// Days that did not fit at the last check, with whether their cutoff had passed.
    overfull: BTreeSet<(StageDay, bool)>,
}

impl CapacityMonitor {
    /// A monitor that has not checked anything yet.
    #[must_use]
    pub const fn new(store: Store, workers: Workers, clock: Clock, capacity: Capacity) -> Self {
        Self {
            store,
            workers,
            clock,
            capacity,
            overfull: BTreeSet::new(),
        }
    }

    /// A warning for each day that does not fit, unless the last check warned of it in the same phase (before or after its
    /// cutoff). Days whose episodes have no measured duration yet give no warning.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub async fn check(&mut self) -> Result<Vec<CapacityWarning>, StoreError> {
        let now = self.clock.now();
        let (mut warnings, mut overfull) = (Vec::new(), BTreeSet::new());
        for stage in self.store.stages().await? {
            let forecast =
                capacity::forecast(&self.store, &self.workers, &self.capacity, stage.id, now);
            let days = forecast.await?.days.into_iter();
            for load in days.filter(|load| load.fit == Fit::Not) {
                let day = StageDay {
                    stage: stage.id,
                    date: load.day,
                };
                let key = (day, load.is_under_way);
                overfull.insert(key);
                if !self.overfull.contains(&key) {
                    warnings.push(CapacityWarning {
                        stage: stage.name.clone(),
                        load,
                    });
                }
            }
        }
        self.overfull = overfull;
        Ok(warnings)
    }

    /// Logs a line for each day that does not fit any more. Checks at each cutoff and every minute, until `shutdown` completes.
    pub async fn run(mut self, shutdown: impl Future<Output = ()>) {
        tokio::pin!(shutdown);
        let mut events = self.store.events();
        loop {
            match self.check().await {
                Ok(warnings) => {
                    for CapacityWarning { stage, load } in warnings {
                        tracing::warn!(%stage, day = %load.day, "{}", load.summary);
                    }
                }
                Err(error) => {
                    tracing::debug!(%error, "cannot read the capacity forecast; trying again");
                }
            }
            let timer = tokio::time::sleep(CHECK_INTERVAL);
            tokio::pin!(timer);
            loop {
                tokio::select! {
                    () = &mut shutdown => return,
                    () = &mut timer => break,
                    change = events.recv() => match change {
                        Ok(Change::Recorded(record))
                            if matches!(record.event, Event::DayStarted { .. }) => break,
                        // A missed event may have been a cutoff.
                        Err(RecvError::Lagged(_)) => break,
                        Err(RecvError::Closed) => return,
                        Ok(_) => {}
                    },
                }
            }
        }
    }
}
