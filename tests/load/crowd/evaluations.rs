//! The progress of each evaluation, so that its last *shard* (a group of episodes, which a worker runs as one job) can end it
//! without a score.

use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Notify;
use uuid::Uuid;

/// The progress of all evaluations, by id.
#[derive(Debug)]
pub(crate) struct Evaluations {
    /// Shards of one evaluation.
    shards: u32,
    progress: Mutex<HashMap<Uuid, Progress>>,
    changed: Notify,
}

#[derive(Debug, Default)]
struct Progress {
    /// Shards that workers have finished, for which simulated workers sleep.
    played: u32,
    /// Results that NATS has stored.
    results: u32,
}

impl Evaluations {
    pub(crate) fn new(shards: u32) -> Self {
        Self {
            shards,
            progress: Mutex::default(),
            changed: Notify::new(),
        }
    }

    /// Counts a shard as finished by its worker. Is it the evaluation's last one?
    pub(crate) fn record_played(&self, id: Uuid) -> bool {
        let mut progress = self.progress();
        let evaluation = progress.entry(id).or_default();
        evaluation.played += 1;
        evaluation.played >= self.shards
    }

    /// Counts a shard's result as stored in NATS, which delivers results in this order.
    pub(crate) fn record_result(&self, id: Uuid) {
        self.progress().entry(id).or_default().results += 1;
        self.changed.notify_waiters();
    }

    /// Waits for the results of all other shards: after the last shard's fault the evaluation accepts no results.
    pub(crate) async fn wait_for_other_results(&self, id: Uuid) {
        loop {
            let changed = self.changed.notified();
            if self.has_other_results(id) {
                return;
            }
            changed.await;
        }
    }

    fn has_other_results(&self, id: Uuid) -> bool {
        let progress = self.progress();
        progress
            .get(&id)
            .is_some_and(|evaluation| evaluation.results + 1 >= self.shards)
    }

    /// Ignores poisoning: the counts are consistent even after a panic.
    fn progress(&self) -> MutexGuard<'_, HashMap<Uuid, Progress>> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
