//! Cgroups that a killed service left behind.

use super::{
    hierarchy::{FOLDER, Hierarchies},
    leaf::{LEAF_PREFIX, end_all, remove_leaf},
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
    let entries = folders
        .into_iter()
        .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten());
    let of_the_dead = entries.filter(|entry| {
        let name = entry.file_name();
        let owner = name
            .to_str()
            .and_then(|name| Owner::of_name(name, LEAF_PREFIX));
        owner.is_some_and(Owner::is_dead)
    });
    let leaves: Vec<PathBuf> = of_the_dead.map(|entry| entry.path()).collect();
    // All before one is waited for: an agent that is frozen in one hierarchy dies in none.
    for leaf in &leaves {
        tracing::info!(cgroup = %leaf.display(), "removing the cgroup of a dead service's agent");
        end_all(leaf);
    }
    for leaf in &leaves {
        remove_leaf(leaf);
    }
    leaves.len()
}
