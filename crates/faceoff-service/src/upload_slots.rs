//! Limit of concurrent uploads per team.

use faceoff_types::TeamId;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Each team has its own slots, so one team's uploads never block another's.
#[derive(Debug)]
pub struct UploadSlots {
    per_team: usize,
    running: Mutex<HashMap<TeamId, usize>>,
}

/// A running upload; dropping it frees the slot.
#[derive(Debug)]
pub struct UploadSlot {
    slots: Arc<UploadSlots>,
    team: TeamId,
}

impl UploadSlots {
    pub fn new(per_team: usize) -> Self {
        Self {
            per_team,
            running: Mutex::default(),
        }
    }

    /// Takes a slot of the team, if one is free.
    pub fn acquire(self: &Arc<Self>, team: TeamId) -> Option<UploadSlot> {
        let mut running = self.running();
        let count = running.entry(team).or_default();
        if *count >= self.per_team {
            return None;
        }
        *count += 1;
        Some(UploadSlot {
            slots: Arc::clone(self),
            team,
        })
    }

    /// A panic cannot leave a count half-written.
    fn running(&self) -> MutexGuard<'_, HashMap<TeamId, usize>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for UploadSlot {
    fn drop(&mut self) {
        let mut running = self.slots.running();
        if let Some(count) = running.get_mut(&self.team) {
            *count -= 1;
            if *count == 0 {
                running.remove(&self.team);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upload_slots_are_counted_per_team() {
        let slots = Arc::new(UploadSlots::new(2));
        let (one, other) = (TeamId::new(), TeamId::new());
        let held = [slots.acquire(one), slots.acquire(one)];
        assert!(held.iter().all(Option::is_some));
        assert!(slots.acquire(one).is_none());
        let others = slots.acquire(other);
        assert!(others.is_some());
        drop(held);
        assert!(slots.acquire(one).is_some());
        drop(others);
        assert!(slots.running().is_empty(), "idle teams are forgotten");
    }
}
