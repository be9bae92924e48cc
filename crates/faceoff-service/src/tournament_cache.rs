//! Cache of expensive results per tournament, valid until the season changes.

use crate::problem::Problem;
use faceoff_store::Store;
use faceoff_types::TournamentId;
use std::{collections::HashMap, sync::Arc};
use tokio::sync::Mutex;

/// Largest number of entries in the cache; a season has a few tournaments.
const MAX_ENTRIES: usize = 20;

/// The result for each tournament, with the id of the newest change of the season that it includes. Only one result is computed
/// at a time: the slots that run evaluations and games need the CPUs.
#[derive(Debug)]
pub struct TournamentCache<T> {
    entries: Mutex<HashMap<TournamentId, (i64, Arc<T>)>>,
}

impl<T> Default for TournamentCache<T> {
    fn default() -> Self {
        Self {
            entries: Mutex::default(),
        }
    }
}

impl<T> TournamentCache<T> {
    /// The cached result, if it includes the newest change; otherwise calls `compute` and caches its result.
    pub async fn get(
        &self,
        store: &Store,
        id: TournamentId,
        compute: impl AsyncFnOnce() -> Result<T, Problem>,
    ) -> Result<Arc<T>, Problem> {
        let mut entries = self.entries.lock().await;
        // Read before the computation: a change in between invalidates the entry.
        let change = store.newest_change().await?;
        let cached = entries
            .get(&id)
            .filter(|(cached_change, _)| *cached_change == change);
        if let Some((_, result)) = cached {
            return Ok(Arc::clone(result));
        }
        let result = Arc::new(compute().await?);
        if entries.len() >= MAX_ENTRIES && !entries.contains_key(&id) {
            entries.clear();
        }
        entries.insert(id, (change, Arc::clone(&result)));
        Ok(result)
    }
}
