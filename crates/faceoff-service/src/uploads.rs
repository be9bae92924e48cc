//! How many uploads each team has under way.

use faceoff_types::TeamId;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Every team has places of its own, so that one team's uploads never take another's.
#[derive(Debug)]
pub struct Uploads {
    at_once: usize,
    under_way: Mutex<HashMap<TeamId, usize>>,
}

/// One upload under way, until it is dropped.
#[derive(Debug)]
pub struct Place {
    uploads: Arc<Uploads>,
    team: TeamId,
}

impl Uploads {
    pub fn new(at_once: usize) -> Self {
        Self {
            at_once,
            under_way: Mutex::default(),
        }
    }

    /// A place of the team's, if it has one left.
    pub fn enter(self: &Arc<Self>, team: TeamId) -> Option<Place> {
        let mut under_way = self.under_way();
        let of_team = under_way.entry(team).or_default();
        if *of_team >= self.at_once {
            return None;
        }
        *of_team += 1;
        Some(Place {
            uploads: Arc::clone(self),
            team,
        })
    }

    /// A number is whole whatever panicked beside it.
    fn under_way(&self) -> MutexGuard<'_, HashMap<TeamId, usize>> {
        self.under_way
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut under_way = self.uploads.under_way();
        if let Some(of_team) = under_way.get_mut(&self.team) {
            *of_team -= 1;
            if *of_team == 0 {
                under_way.remove(&self.team);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_team_has_places_of_its_own() {
        let uploads = Arc::new(Uploads::new(2));
        let (one, other) = (TeamId::new(), TeamId::new());
        let held = [uploads.enter(one), uploads.enter(one)];
        assert!(held.iter().all(Option::is_some));
        assert!(uploads.enter(one).is_none());
        let others = uploads.enter(other);
        assert!(others.is_some());
        drop(held);
        assert!(uploads.enter(one).is_some());
        drop(others);
        assert!(uploads.under_way().is_empty(), "nobody is remembered");
    }
}
