//! What a killed service left behind.

use crate::{
    cgroup,
    memory_image::{IMAGE_PREFIX, MEMORY},
    owner::Owner,
};
use std::{fs, path::Path};

/// Scratch folders, where no sandbox has one of its own, begin with this.
pub(crate) const SCRATCH_PREFIX: &str = "faceoff-scratch-";

/// Removes the cgroups, scratch folders and images in memory, and ends the processes, of agents whose service is dead.
/// Those of living services, this one's included, are left alone. Returns how many were removed. Done by
/// itself before a service's first agent; call it at start-up to have the memory back earlier.
pub fn sweep_stale() -> usize {
    cgroup::sweep()
        + sweep_folder(&std::env::temp_dir(), SCRATCH_PREFIX)
        + sweep_folder(Path::new(MEMORY), IMAGE_PREFIX)
}

fn sweep_folder(folder: &Path, prefix: &str) -> usize {
    let mut removed = 0;
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let owner = name.to_str().and_then(|name| Owner::of_name(name, prefix));
        if owner.is_some_and(Owner::is_dead) && fs::remove_dir_all(entry.path()).is_ok() {
            tracing::info!(folder = %entry.path().display(), "removed what a dead service has left");
            removed += 1;
        }
    }
    removed
}
