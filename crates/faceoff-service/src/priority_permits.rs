//! A limited number of places, of which the last are kept: visitors cannot take all places, so that a crowd of them keeps
//! neither teams nor organisers out.

use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The kind of caller, as far as known, in ascending priority: under overload the last places are kept for the higher ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// Without a token that was verified before.
    Visitor,
    /// With a token or session of a team.
    Team,
    Organiser,
}

/// A limited number of places, for requests or connections, of which the last are kept for teams and organisers.
#[derive(Debug, Clone)]
pub struct PriorityPermits {
    max: usize,
    free: Arc<Semaphore>,
}

/// A place, until it is dropped.
#[derive(Debug)]
pub struct PriorityPermit {
    _permit: OwnedSemaphorePermit,
}

impl PriorityPermits {
    pub fn new(max: usize) -> Self {
        Self {
            max,
            free: Arc::new(Semaphore::new(max)),
        }
    }

    /// Takes a place. Visitors get one while at most three quarters of the places are taken with it, teams up to seven eighths,
    /// and organisers up to the last one.
    pub fn take(&self, precedence: Precedence) -> Option<PriorityPermit> {
        let available = match precedence {
            Precedence::Visitor => (self.max * 3).div_ceil(4),
            Precedence::Team => (self.max * 7).div_ceil(8),
            Precedence::Organiser => self.max,
        };
        let permit = Arc::clone(&self.free).try_acquire_owned().ok()?;
        (self.taken() <= available).then_some(PriorityPermit { _permit: permit })
    }

    /// Number of places that are taken.
    pub fn taken(&self) -> usize {
        self.max.saturating_sub(self.free.available_permits())
    }

    /// Number of all places.
    pub const fn max(&self) -> usize {
        self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_places_are_kept_for_teams_and_organisers() {
        let order = [Precedence::Visitor, Precedence::Team, Precedence::Organiser];
        for (max, expected) in [
            (0, [0, 0, 0]),
            (1, [1, 1, 1]),
            (2, [2, 2, 2]),
            (4, [3, 4, 4]),
            (512, [384, 448, 512]),
        ] {
            let places = PriorityPermits::new(max);
            let mut held = Vec::new();
            let taken = order.map(|precedence| {
                while let Some(place) = places.take(precedence) {
                    held.push(place);
                }
                places.taken()
            });
            assert_eq!(taken, expected, "{max}");
            held.truncate(expected[0].saturating_sub(1));
            let again = places.take(Precedence::Visitor);
            assert_eq!(again.is_some(), max > 0, "{max}");
        }
    }
}
