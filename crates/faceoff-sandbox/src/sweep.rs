//! What a killed service left behind.

use crate::{cgroup, owner::Owner};
use std::fs;

/// Scratch folders, where no sandbox has one of its own, begin with this.
pub(crate) const SCRATCH_PREFIX: &str = "faceoff-scratch-";

/// Removes the cgroups and scratch folders, and ends the processes, of agents whose service is dead.
/// Those of living services, this one's included, are left alone. Returns how many were removed. Done by
/// itself before a service's first agent; call it at start-up to have the memory back earlier.
pub fn sweep_stale() -> usize {
    let mut removed = cgroup::sweep();
    for entry in fs::read_dir(std::env::temp_dir())
        .into_iter()
        .flatten()
        .flatten()
    {
        let name = entry.file_name();
        let owner = name
            .to_str()
            .and_then(|name| Owner::of_name(name, SCRATCH_PREFIX));
        if owner.is_some_and(Owner::is_dead) && fs::remove_dir_all(entry.path()).is_ok() {
            tracing::info!(folder = %entry.path().display(), "removed the scratch folder of a dead service's agent");
            removed += 1;
        }
    }
    removed
}
