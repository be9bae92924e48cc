//! Removes the remains of a killed service: of a process that started agents and could not clean up after them.

use crate::{
    cgroup,
    memory_image::{IMAGE_PREFIX, MEMORY_FOLDER},
    owner::Owner,
};
use std::{fs, path::Path};

/// Prefix of the scratch folders that agents without a mount namespace get on the host.
pub(crate) const SCRATCH_PREFIX: &str = "faceoff-scratch-";

/// Removes the cgroups, scratch folders and memory images of agents whose service is dead, and kills their processes.
/// Living services, including this one, keep theirs. Returns the number of removed items.
///
/// A service's first spawn calls it automatically; a call at start-up frees the memory earlier.
pub fn remove_remains_of_dead_services() -> usize {
    cgroup::remove_stale_leaves()
        + remove_stale_folders(&std::env::temp_dir(), SCRATCH_PREFIX)
        + remove_stale_folders(Path::new(MEMORY_FOLDER), IMAGE_PREFIX)
}

fn remove_stale_folders(folder: &Path, prefix: &str) -> usize {
    let mut removed = 0;
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let owner = name.to_str().and_then(|name| Owner::parse(name, prefix));
        if owner.is_some_and(Owner::is_dead) && fs::remove_dir_all(entry.path()).is_ok() {
            tracing::info!(folder = %entry.path().display(), "removed a folder of a dead service");
            removed += 1;
        }
    }
    removed
}
