//! Callers whose tokens were verified recently. Under overload the server tells by them whose request it is without reading the
//! database.

use crate::priority_permits::Precedence;
use std::{
    collections::HashMap,
    mem,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use uuid::Uuid;

/// Verified tokens in memory, at most: more than a large season's programs and browsers have.
const MAX_CALLERS: usize = 10_000;

/// A token counts as verified for this time: it may have been revoked meanwhile.
const VALIDITY: Duration = Duration::from_mins(10);

/// Hash of a token's secret.
type SecretHash = [u8; 32];

/// The callers by the hashes of their tokens' secrets. Those that were not seen for the longest time are forgotten.
#[derive(Debug, Default)]
pub(crate) struct RecentCallers(Mutex<Generations>);

/// Two generations: when the newer one is full, it replaces the older one, whose entries are forgotten.
#[derive(Debug, Default)]
struct Generations {
    newer: HashMap<SecretHash, Verified>,
    older: HashMap<SecretHash, Verified>,
}

/// Whose token it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RecentCaller {
    pub precedence: Precedence,
    /// The id of the user, or of the team whose API client it is; `None`: the operator.
    pub owner: Option<Uuid>,
}

#[derive(Debug, Clone, Copy)]
struct Verified {
    caller: RecentCaller,
    at: Instant,
}

impl RecentCallers {
    /// Whose token it is, if it was verified recently.
    pub(crate) fn find(&self, hash: &SecretHash) -> Option<RecentCaller> {
        let generations = self.lock();
        let found = generations.newer.get(hash);
        let found = found.or_else(|| generations.older.get(hash))?;
        (found.at.elapsed() < VALIDITY).then_some(found.caller)
    }

    /// Remembers whose token it is that was just verified.
    pub(crate) fn insert(&self, hash: SecretHash, caller: RecentCaller) {
        let mut generations = self.lock();
        if generations.newer.len() >= MAX_CALLERS / 2 && !generations.newer.contains_key(&hash) {
            generations.older = mem::take(&mut generations.newer);
        }
        let at = Instant::now();
        generations.newer.insert(hash, Verified { caller, at });
    }

    /// Forgets a token that is not valid any more.
    pub(crate) fn remove(&self, hash: &SecretHash) {
        let mut generations = self.lock();
        generations.newer.remove(hash);
        generations.older.remove(hash);
    }

    /// A panic while the lock is held leaves every entry intact.
    fn lock(&self) -> MutexGuard<'_, Generations> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(number: usize) -> SecretHash {
        *blake3::hash(&number.to_le_bytes()).as_bytes()
    }

    #[test]
    fn callers_seen_long_ago_are_forgotten() {
        let callers = RecentCallers::default();
        for number in 0..3 * MAX_CALLERS {
            let caller = |precedence| RecentCaller {
                precedence,
                owner: None,
            };
            callers.insert(hash(number), caller(Precedence::Team));
            // The first one makes requests all the time.
            callers.insert(hash(0), caller(Precedence::Organiser));
        }
        let first = callers.find(&hash(0)).unwrap();
        assert_eq!(first.precedence, Precedence::Organiser);
        assert_eq!(callers.find(&hash(1)), None);
        let newest = 3 * MAX_CALLERS - 1;
        let kept = (0..=newest).filter(|number| callers.find(&hash(*number)).is_some());
        let kept = kept.count();
        assert!((MAX_CALLERS / 2..=MAX_CALLERS).contains(&kept), "{kept}");
        callers.remove(&hash(newest));
        assert_eq!(callers.find(&hash(newest)), None);
    }
}
