use crate::cgroup;
use rustix::process::{Signal, pidfd_send_signal};
use std::{os::fd::OwnedFd, path::PathBuf};

/// Ends one agent's tree from any thread, while the one that speaks with it may be waiting. Whoever holds the
/// [`crate::AgentProcess`] reaps it all the same.
#[derive(Debug)]
pub struct Killer {
    /// The sandbox's first process, with which all in it ends, and the service's child.
    pub(crate) processes: Vec<OwnedFd>,
    pub(crate) cgroups: Vec<PathBuf>,
}

impl Killer {
    /// Kills what still lives of it; does not wait. May be called at any time, and again.
    pub fn kill(&self) {
        for process in &self.processes {
            // One that has ended is fine: the descriptor stays its own.
            let _ = pidfd_send_signal(process, Signal::KILL);
        }
        for cgroup in &self.cgroups {
            cgroup::end_all(cgroup);
        }
    }
}
