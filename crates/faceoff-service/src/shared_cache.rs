//! Cache of answers that many readers share: responses, board rows, ratings, analyses. Whatever an answer depends on is part of
//! its key, so no entry is ever outdated: an answer from the season's data has the newest change in its key.
//!
//! All caches have the same types inside, so that the library's code is compiled once: with keys and answers of their own, each
//! would have a copy of it.

use moka::{future::Cache, policy::EvictionPolicy};
use std::{
    any::Any,
    fmt,
    hash::{Hash, Hasher},
    marker::PhantomData,
    pin::Pin,
    sync::Arc,
};

/// An answer, or an error, of any type.
type Anything = Arc<dyn Any + Send + Sync>;

/// A cache that discards the entries that were used least recently. Cloned answers share their data.
pub struct SharedCache<K, V> {
    cache: Cache<Vec<u8>, Anything>,
    types: PhantomData<fn(K) -> V>,
}

impl<K, V> fmt::Debug for SharedCache<K, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SharedCache").finish_non_exhaustive()
    }
}

impl<K, V> SharedCache<K, V>
where
    K: Hash + Eq + Send + Sync + 'static,
    V: Send + Sync + 'static,
{
    /// A cache of at most this number of answers.
    pub(crate) fn with_entries(max_entries: u64) -> Self {
        Self::new(max_entries, |_| 1)
    }

    /// A cache of at most `max_bytes`, with the size of each answer estimated by `bytes`.
    pub(crate) fn with_bytes(max_bytes: u64, bytes: fn(&V) -> usize) -> Self {
        Self::new(max_bytes, bytes)
    }

    fn new(max_capacity: u64, size: fn(&V) -> usize) -> Self {
        Self {
            cache: new_cache(
                max_capacity,
                Box::new(move |answer| size(&downcast::<V>(answer))),
            ),
            types: PhantomData,
        }
    }

    /// The cached answer, or the result of `compute`. Concurrent requests share one computation. Errors are not cached.
    ///
    /// # Errors
    /// That of `compute`.
    pub async fn get<E>(
        &self,
        key: K,
        compute: impl Future<Output = Result<Arc<V>, E>> + Send,
    ) -> Result<Arc<V>, E>
    where
        E: Clone + Send + Sync + 'static,
    {
        let compute = async move {
            match compute.await {
                Ok(answer) => Ok(answer as Anything),
                Err(error) => Err(Arc::new(error) as Anything),
            }
        };
        let found = get_or_compute(&self.cache, key_bytes(&key), Box::pin(compute)).await;
        found
            .map(|answer| downcast(&answer))
            .map_err(|error| E::clone(&downcast(&error)))
    }

    /// The answer, if it is cached.
    pub(crate) async fn cached(&self, key: &K) -> Option<Arc<V>> {
        let answer = self.cache.get(&key_bytes(key)).await;
        answer.map(|answer| downcast(&answer))
    }

    /// Adds an answer.
    pub(crate) async fn insert(&self, key: K, answer: Arc<V>) {
        self.cache.insert(key_bytes(&key), answer).await;
    }
}

/// A cache in which `size` gives the share of an answer in the capacity.
fn new_cache(
    max_capacity: u64,
    size: Box<dyn Fn(&Anything) -> usize + Send + Sync>,
) -> Cache<Vec<u8>, Anything> {
    Cache::builder()
        .max_capacity(max_capacity)
        .weigher(move |_: &Vec<u8>, answer| u32::try_from(size(answer)).unwrap_or(u32::MAX))
        .eviction_policy(EvictionPolicy::lru())
        .build()
}

/// The cached answer, or the result of `compute`.
async fn get_or_compute(
    cache: &Cache<Vec<u8>, Anything>,
    key: Vec<u8>,
    compute: Pin<Box<dyn Future<Output = Result<Anything, Anything>> + Send + '_>>,
) -> Result<Anything, Anything> {
    let answer = cache.try_get_with(key, compute).await;
    answer.map_err(|error| Anything::clone(&error))
}

/// An answer or error as the type that the cache was given.
fn downcast<T: Send + Sync + 'static>(anything: &Anything) -> Arc<T> {
    let typed = Arc::clone(anything).downcast();
    typed.expect("a cache has answers and errors of one type each")
}

/// What a key writes into its hasher. Different keys of one type write different bytes.
fn key_bytes(key: &impl Hash) -> Vec<u8> {
    let mut bytes = KeyBytes(Vec::new());
    key.hash(&mut bytes);
    bytes.0
}

/// A hasher that keeps all that is written into it.
struct KeyBytes(Vec<u8>);

impl Hasher for KeyBytes {
    fn write(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Not used: the bytes are the key.
    fn finish(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// Asks the cache for `key`, and counts the computation.
    async fn ask(cache: &SharedCache<u32, String>, key: u32, computations: &AtomicU32) -> String {
        let compute = async {
            // The other requests begin before this one has its answer.
            tokio::task::yield_now().await;
            computations.fetch_add(1, Ordering::Relaxed);
            if key == 0 {
                return Err("refused");
            }
            Ok(Arc::new(format!("answer {key}")))
        };
        match cache.get(key, compute).await {
            Ok(answer) => String::clone(&answer),
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
        let cache = SharedCache::<u32, String>::with_bytes(32, String::len);
        let computations = AtomicU32::new(0);
        for key in 1..=20 {
            for _ in 0..20 {
                ask(&cache, key, &computations).await;
            }
            cache.cache.run_pending_tasks().await;
            assert!(cache.cached(&key).await.is_some(), "{key}");
        }
        assert_eq!(computations.load(Ordering::Relaxed), 20);
        assert!(cache.cached(&1).await.is_none());
    }
}
