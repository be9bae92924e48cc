//! Cgroups that a killed service left behind.

use super::{
    hierarchy::{FOLDER, Hierarchies},
    leaf::{LEAF_PREFIX, remove_leaf},
};
use crate::owner::Owner;
use std::{collections::BTreeSet, fs, path::PathBuf};

/// Removes the cgroups, and what lives in them, of agents whose service is dead; returns how many.
pub(crate) fn sweep() -> usize {
    let Ok(hierarchies) = Hierarchies::read() else {
        return 0;
    };
    let folders: BTreeSet<PathBuf> = ["memory", "pids", "cpu", "cpuacct", "cpuset", "freezer"]
        .iter()
        .filter_map(|controller| hierarchies.find(controller))
        .map(|home| home.own.join(FOLDER))
        .collect();
    let mut removed = 0;
    for folder in folders {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let owner = name
                .to_str()
                .and_then(|name| Owner::of_name(name, LEAF_PREFIX));
            if owner.is_some_and(Owner::is_dead) {
                tracing::info!(cgroup = %entry.path().display(), "removing the cgroup of a dead service's agent");
                remove_leaf(&entry.path());
                removed += 1;
            }
        }
    }
    removed
}
