//! Cache of answers that many readers share: responses, board rows, ratings, analyses. Whatever an answer depends on is part of
//! its key, so no entry is ever outdated: an answer from the season's data has the newest change in its key.

use moka::{future::Cache, policy::EvictionPolicy};
use std::{fmt, hash::Hash, sync::Arc};

/// A cache that discards the entries that were used least recently. Cloned answers share their data.
pub struct SharedCache<K, V: ?Sized>(Cache<K, Arc<V>>);

impl<K, V: ?Sized> fmt::Debug for SharedCache<K, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SharedCache").finish_non_exhaustive()
    }
}

impl<K, V> SharedCache<K, V>
where
    K: Hash + Eq + Send + Sync + 'static,
    V: ?Sized + Send + Sync + 'static,
{
    /// A cache of at most this number of answers.
    pub(crate) fn with_entries(max_entries: u64) -> Self {
        let cache = Cache::builder().max_capacity(max_entries);
        Self(cache.eviction_policy(EvictionPolicy::lru()).build())
    }

    /// A cache of at most `max_bytes`, with the size of each answer estimated by `bytes`.
    pub(crate) fn with_bytes(max_bytes: u64, bytes: fn(&V) -> usize) -> Self {
        let cache = Cache::builder()
            .max_capacity(max_bytes)
            .weigher(move |_, answer: &Arc<V>| u32::try_from(bytes(answer)).unwrap_or(u32::MAX));
        Self(cache.eviction_policy(EvictionPolicy::lru()).build())
    }

    /// The cached answer, or the result of `compute`. Concurrent requests share one computation. Errors are not cached.
    ///
    /// # Errors
    /// That of `compute`.
    pub async fn get<E>(
        &self,
        key: K,
        compute: impl Future<Output = Result<Arc<V>, E>>,
    ) -> Result<Arc<V>, E>
    where
        E: Clone + Send + Sync + 'static,
    {
        let answer = self.0.try_get_with(key, compute).await;
        answer.map_err(|error| E::clone(&error))
    }

    /// The answer, if it is cached.
    pub(crate) async fn cached(&self, key: &K) -> Option<Arc<V>> {
        self.0.get(key).await
    }

    /// Adds an answer.
    pub(crate) async fn insert(&self, key: K, answer: Arc<V>) {
        self.0.insert(key, answer).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// Asks the cache for `key`, and counts the computation.
    async fn ask(cache: &SharedCache<u32, str>, key: u32, computations: &AtomicU32) -> String {
        let compute = async {
            // The other requests begin before this one has its answer.
            tokio::task::yield_now().await;
            computations.fetch_add(1, Ordering::Relaxed);
            if key == 0 {
                return Err("refused");
            }
            Ok(Arc::from(format!("answer {key}")))
        };
        match cache.get(key, compute).await {
            Ok(answer) => answer.to_string(),
            Err(error) => error.to_owned(),
        }
    }

    #[tokio::test]
    async fn requests_share_a_computation_and_errors_are_not_cached() {
        let cache = SharedCache::with_entries(10);
        let computations = AtomicU32::new(0);
        for _ in 0..2 {
            let answers =
                tokio::join!(ask(&cache, 1, &computations), ask(&cache, 1, &computations));
            assert_eq!(answers, ("answer 1".to_owned(), "answer 1".to_owned()));
        }
        assert_eq!(computations.load(Ordering::Relaxed), 1);
        for _ in 0..2 {
            assert_eq!(ask(&cache, 0, &computations).await, "refused");
        }
        assert_eq!(computations.load(Ordering::Relaxed), 3);
    }

    /// Keys with the newest change are new after each change; popular earlier ones must make room for them.
    #[tokio::test]
    async fn new_answers_replace_those_used_least_recently() {
        let cache = SharedCache::<u32, str>::with_bytes(32, str::len);
        let computations = AtomicU32::new(0);
        for key in 1..=20 {
            for _ in 0..20 {
                ask(&cache, key, &computations).await;
            }
            cache.0.run_pending_tasks().await;
            assert!(cache.cached(&key).await.is_some(), "{key}");
        }
        assert_eq!(computations.load(Ordering::Relaxed), 20);
        assert!(cache.cached(&1).await.is_none());
    }
}
