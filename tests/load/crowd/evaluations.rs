//! How far each evaluation is, so that the last shard of each ends it without a score.

use std::{
    collections::HashMap,
    sync::{Mutex, MutexGuard, PoisonError},
};
use tokio::sync::Notify;
use uuid::Uuid;

/// All of them, by id.
#[derive(Debug)]
pub(crate) struct Evaluations {
    shards: u32,
    all: Mutex<HashMap<Uuid, Shards>>,
    changed: Notify,
}

#[derive(Debug, Default)]
struct Shards {
    played: u32,
    handed_in: u32,
}

impl Evaluations {
    pub(crate) fn of_shards(shards: u32) -> Self {
        Self {
            shards,
            all: Mutex::default(),
            changed: Notify::new(),
        }
    }

    /// A shard was played. Is it the evaluation's last?
    pub(crate) fn ends(&self, id: Uuid) -> bool {
        let mut all = self.all();
        let shards = all.entry(id).or_default();
        shards.played += 1;
        shards.played >= self.shards
    }

    /// What came of a shard is in NATS, which delivers in this order.
    pub(crate) fn handed_in(&self, id: Uuid) {
        self.all().entry(id).or_default().handed_in += 1;
        self.changed.notify_waiters();
    }

    /// Waits for all but the last: an outcome that comes after that one would find the evaluation over.
    pub(crate) async fn others_are_handed_in(&self, id: Uuid) {
        loop {
            let changed = self.changed.notified();
            if self.has_others(id) {
                return;
            }
            changed.await;
        }
    }

    fn has_others(&self, id: Uuid) -> bool {
        let all = self.all();
        all.get(&id)
            .is_some_and(|shards| shards.handed_in + 1 >= self.shards)
    }

    /// Counts are whole whatever panicked beside them.
    fn all(&self) -> MutexGuard<'_, HashMap<Uuid, Shards>> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
