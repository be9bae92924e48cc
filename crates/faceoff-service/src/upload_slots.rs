//! Limit of concurrent uploads per team. An upload occupies one of the team's *slots* until it ends.

use faceoff_types::TeamId;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Each team has its own slots, so one team's uploads never block another's.
#[derive(Debug)]
pub struct UploadSlots {
    /// Slots of each team.
    per_team: usize,
    /// Running uploads of each team.
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

    /// The counts; a panic of another thread cannot leave one half-written.
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
        let (team, other_team) = (TeamId::new(), TeamId::new());
        let acquired = [slots.acquire(team), slots.acquire(team)];
        assert!(acquired.iter().all(Option::is_some));
        assert!(slots.acquire(team).is_none());
        let other_slot = slots.acquire(other_team);
        assert!(other_slot.is_some());
        drop(acquired);
        assert!(slots.acquire(team).is_some());
        drop(other_slot);
        assert!(
            slots.running().is_empty(),
            "teams without uploads are removed"
        );
    }
}
