//! Detects an agent that has closed its standard output and still runs.
//!
//! bubblewrap's own process inherits the writing end and holds it open as long as it lives. So the kernel reports
//! no end of file when the agent closes its output. `/proc` lists the other processes that have it open.

use rustix::process::Pid;
use std::{fs, io};

/// Limit of the inspected descriptors. A check must cost the evaluator at most a few milliseconds, so an agent with
/// more descriptors counts as still having its output open.
const MAX_DESCRIPTORS: usize = 4096;

/// Does a process of the tree other than `watcher` have a descriptor that `/proc` names `output`? Also `true` if
/// this is unknown: then the deadline decides.
pub(crate) fn is_open_in_tree(output: &str, tree: &[Pid], watcher: Pid) -> bool {
    let agents: Vec<_> = tree.iter().filter(|pid| **pid != watcher).collect();
    let mut left = MAX_DESCRIPTORS;
    agents.is_empty()
        || agents
            .into_iter()
            .any(|pid| left == 0 || holds(pid.as_raw_nonzero().get(), output, &mut left))
}

fn holds(pid: i32, output: &str, left: &mut usize) -> bool {
    match fs::read_dir(format!("/proc/{pid}/fd")) {
        Ok(entries) => entries.flatten().any(|entry| {
            *left = left.saturating_sub(1);
            *left == 0
                || fs::read_link(entry.path()).is_ok_and(|target| target.as_os_str() == output)
        }),
        Err(error) => error.kind() != io::ErrorKind::NotFound,
    }
}
