//! Cgroups that a killed service left behind.

use super::{
    agent::{Hierarchies, remove_leaf},
    hierarchy::FOLDER,
};
use std::{collections::BTreeSet, fs, path::PathBuf};

/// Removes the cgroups, and ends the processes, of agents whose service is dead. Those of living
/// services, this one's included, are left alone. Returns how many were removed. Done by itself before a
/// service's first agent; call it at start-up to have the memory back earlier.
pub fn sweep_stale() -> usize {
    let Ok(hierarchies) = Hierarchies::read() else {
        return 0;
    };
    let folders: BTreeSet<PathBuf> = ["memory", "pids", "cpu", "cpuacct", "cpuset"]
        .iter()
        .filter_map(|controller| hierarchies.find(controller))
        .map(|home| home.own.join(FOLDER))
        .collect();
    let mut removed = 0;
    for folder in folders {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            if name
                .to_str()
                .and_then(owner)
                .is_some_and(|owner| !owner.lives())
            {
                tracing::info!(cgroup = %entry.path().display(), "removing the cgroup of a dead service's agent");
                remove_leaf(&entry.path());
                removed += 1;
            }
        }
    }
    removed
}

/// The service that made a cgroup: its pid, and when it started, because pids are used again.
struct Owner {
    pid: u32,
    start: u64,
}

impl Owner {
    fn lives(&self) -> bool {
        start_time(self.pid).is_some_and(|start| self.start == 0 || start == self.start)
    }
}

fn owner(leaf: &str) -> Option<Owner> {
    let mut parts = leaf.strip_prefix("agent-")?.split('-');
    Some(Owner {
        pid: parts.next()?.parse().ok()?,
        start: parts.next()?.parse().ok()?,
    })
}

/// When process `pid` started, in clock ticks since boot; `None` if there is none, or a dead one.
pub(super) fn start_time(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in parentheses, may hold anything; the fields after it are plain. State is the
    // first, the start time the 20th.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
    let state = fields.next()?;
    if matches!(state, "Z" | "X") {
        return None;
    }
    fields.nth(18)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_living_service_is_told_from_one_whose_pid_was_used_again() {
        let pid = std::process::id();
        let start = start_time(pid).expect("we are alive");
        assert!(Owner { pid, start }.lives());
        assert!(
            !Owner {
                pid,
                start: start + 1
            }
            .lives()
        );
    }

    #[test]
    fn only_our_own_names_are_swept() {
        assert!(owner("agent-12-345-0").is_some());
        assert!(owner("agent-12").is_none());
        assert!(owner("somebody-12-345-0").is_none());
    }
}
