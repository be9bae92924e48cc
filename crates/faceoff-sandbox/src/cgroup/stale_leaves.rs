//! Removal of the cgroups (*leaves*) of agents whose *service*, the process that started them, was killed.

use super::{
    hierarchy::{AGENTS_FOLDER, Hierarchies},
    leaf::{LEAF_PREFIX, kill_and_thaw, remove_leaf},
};
use crate::owner::Owner;
use std::{collections::BTreeSet, fs, path::PathBuf};

/// Removes the cgroups of agents whose service is dead, and kills their processes; returns the number of cgroups.
pub(crate) fn remove_stale_leaves() -> usize {
    let Ok(hierarchies) = Hierarchies::read() else {
        return 0;
    };
    let folders: BTreeSet<PathBuf> = ["memory", "pids", "cpu", "cpuacct", "cpuset", "freezer"]
        .iter()
        .filter_map(|controller| hierarchies.find(controller))
        .map(|hierarchy| hierarchy.service_dir.join(AGENTS_FOLDER))
        .collect();
    let entries = folders
        .into_iter()
        .flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten());
    let stale = entries.filter(|entry| {
        let name = entry.file_name();
        let owner = name
            .to_str()
            .and_then(|name| Owner::parse(name, LEAF_PREFIX));
        owner.is_some_and(Owner::is_dead)
    });
    let leaves: Vec<PathBuf> = stale.map(|entry| entry.path()).collect();
    // Kill and thaw in all hierarchies before waiting in one: an agent frozen in any hierarchy does not die.
    for leaf in &leaves {
        tracing::info!(cgroup = %leaf.display(), "removing the cgroup of a dead service's agent");
        kill_and_thaw(leaf);
    }
    for leaf in &leaves {
        remove_leaf(leaf);
    }
    leaves.len()
}
