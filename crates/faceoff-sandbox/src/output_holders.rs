//! Has the agent closed its standard output?
//!
//! bubblewrap's own process holds the pipe's writing end as long as it lives, so the kernel reports no
//! end of file for an agent that closes its output and goes on. Who else holds it, `/proc` tells.

use rustix::process::Pid;
use std::{fs, io};

/// So many descriptors are looked at at the most. Who opens more is believed to hold it: a look must cost the
/// evaluator no more than a few milliseconds.
const MOST: usize = 4096;

/// Does a process of the tree, `watcher` not counted, have open what `/proc` calls `output`? Yes, too,
/// where that cannot be told: then the deadline decides.
pub(crate) fn any_holds(output: &str, tree: &[Pid], watcher: Pid) -> bool {
    let agents: Vec<_> = tree.iter().filter(|pid| **pid != watcher).collect();
    let mut left = MOST;
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
