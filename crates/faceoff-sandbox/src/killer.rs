//! A handle with which any thread can kill an agent.

use crate::cgroup;
use rustix::process::{Signal, pidfd_send_signal};
use std::{os::fd::OwnedFd, path::PathBuf};

/// Kills one agent's process tree from any thread, even while another thread waits for the agent. The owner of
/// the [`crate::AgentProcess`] still reaps the tree.
#[derive(Debug)]
pub struct Killer {
    /// Pidfds of the sandbox's first process, whose end terminates all others in it, and of the child of this process.
    pub(crate) processes: Vec<OwnedFd>,
    pub(crate) cgroups: Vec<PathBuf>,
}

impl Killer {
    /// Kills the remaining processes without waiting. May be called at any time and repeatedly.
    pub fn kill(&self) {
        for process in &self.processes {
            // The process may have ended: a pidfd never refers to another process.
            let _ = pidfd_send_signal(process, Signal::KILL);
        }
        for cgroup in &self.cgroups {
            cgroup::kill_and_thaw(cgroup);
        }
    }
}
