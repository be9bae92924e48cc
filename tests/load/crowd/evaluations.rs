//! The progress of each evaluation, so that its last shard can end it without a score.

use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Notify;
use uuid::Uuid;

/// The progress of all evaluations, by id.
#[derive(Debug)]
pub(crate) struct Evaluations {
    shards: u32,
    all: Mutex<HashMap<Uuid, Progress>>,
    changed: Notify,
}

#[derive(Debug, Default)]
struct Progress {
    played: u32,
    results: u32,
}

impl Evaluations {
    pub(crate) fn new(shards: u32) -> Self {
        Self {
            shards,
            all: Mutex::default(),
            changed: Notify::new(),
        }
    }

    /// Counts a shard as played. Is it the evaluation's last one?
    pub(crate) fn record_played(&self, id: Uuid) -> bool {
        let mut all = self.all();
        let shards = all.entry(id).or_default();
        shards.played += 1;
        shards.played >= self.shards
    }

    /// Counts a shard's result as stored in NATS, which delivers results in this order.
    pub(crate) fn record_result(&self, id: Uuid) {
        self.all().entry(id).or_default().results += 1;
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
        let all = self.all();
        all.get(&id)
            .is_some_and(|shards| shards.results + 1 >= self.shards)
    }

    /// Ignores poisoning: the counts are consistent even after a panic.
    fn all(&self) -> MutexGuard<'_, HashMap<Uuid, Progress>> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
