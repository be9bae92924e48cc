//! Has the agent closed its standard output?
//!
//! bubblewrap's own process holds the pipe's writing end as long as it lives, so the kernel reports no
//! end of file for an agent that closes its output and goes on. Who else holds it, `/proc` tells.

use rustix::{fs::fstat, process::Pid};
use std::{fs, io, os::fd::BorrowedFd};

/// Does a process of the tree, `watcher` not counted, have the pipe open? Yes, too, where that cannot
/// be told: then the deadline decides.
pub(crate) fn any_holds(pipe: BorrowedFd<'_>, tree: &[Pid], watcher: Pid) -> bool {
    let Ok(stat) = fstat(pipe) else { return true };
    let name = format!("pipe:[{}]", stat.st_ino);
    let agents: Vec<_> = tree.iter().filter(|pid| **pid != watcher).collect();
    agents.is_empty()
        || agents
            .into_iter()
            .any(|pid| holds(pid.as_raw_nonzero().get(), &name))
}

fn holds(pid: i32, pipe: &str) -> bool {
    match fs::read_dir(format!("/proc/{pid}/fd")) {
        Ok(entries) => entries.flatten().any(|entry| {
            fs::read_link(entry.path()).is_ok_and(|target| target.as_os_str() == pipe)
        }),
        Err(error) => error.kind() != io::ErrorKind::NotFound,
    }
}
