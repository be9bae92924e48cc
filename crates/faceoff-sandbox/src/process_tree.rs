//! The processes of one agent: their end awaited, forced, and cleaned up after.

use crate::{cgroup::AgentCgroup, line_pipe::wait_for, status_pipe::StatusPipe};
use rustix::{
    event::PollFlags,
    process::{
        Pid, PidfdFlags, Signal, kill_process, kill_process_group, pidfd_open, pidfd_send_signal,
    },
};
use std::{
    fs, io,
    os::fd::{AsFd, OwnedFd},
    process::{Child, ExitStatus},
    time::{Duration, Instant},
};

/// How long a killed process may take to disappear before we say so and go on.
const KILL_PATIENCE: Duration = Duration::from_secs(10);
/// How long bubblewrap may take to follow the sandbox it watches.
const FOLLOW_PATIENCE: Duration = Duration::from_secs(2);

/// The child, what it started, and what holds them.
#[derive(Debug)]
pub(crate) struct ProcessTree {
    child: Child,
    /// Readable when the child has ended.
    child_end: OwnedFd,
    /// The sandbox's first process: with it ends everything inside.
    sandbox_init: Option<OwnedFd>,
    pub(crate) status: Option<StatusPipe>,
    pub(crate) cgroup: Option<AgentCgroup>,
    /// The scratch folder where no sandbox has one of its own.
    scratch: Option<tempfile::TempDir>,
    ended: Option<ExitStatus>,
}

impl ProcessTree {
    pub(crate) fn new(
        mut child: Child,
        status: Option<StatusPipe>,
        cgroup: Option<AgentCgroup>,
        scratch: Option<tempfile::TempDir>,
    ) -> io::Result<Self> {
        match pidfd_open(Pid::from_child(&child), PidfdFlags::empty()) {
            Ok(child_end) => Ok(Self {
                child,
                child_end,
                sandbox_init: None,
                status,
                cgroup,
                scratch,
                ended: None,
            }),
            Err(error) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(error.into())
            }
        }
    }

    /// Remembers the sandbox's first process, unless it is gone again.
    pub(crate) fn watch_init(&mut self, pid: Pid) {
        let Ok(init) = pidfd_open(pid, PidfdFlags::empty()) else {
            return;
        };
        // bubblewrap has one child only. If the process of that number is it, the descriptor is its;
        // else it has ended and the number may belong to a stranger.
        if parent_of(pid.as_raw_nonzero().get()) == Some(self.pid().as_raw_nonzero().get()) {
            self.sandbox_init = Some(init);
        }
    }

    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    pub(crate) fn is_sandboxed(&self) -> bool {
        self.status.is_some()
    }

    /// Has everything been reaped?
    pub(crate) fn has_ended(&self) -> bool {
        self.ended.is_some()
    }

    /// Waits for the child's end and reaps it, with what is left of its process group.
    pub(crate) fn wait(&mut self, deadline: Instant) -> io::Result<Option<ExitStatus>> {
        if self.ended.is_none() && wait_for(self.child_end.as_fd(), PollFlags::IN, deadline)? {
            // Not reaped yet, so its number is still its own, and so is the group's.
            let _ = kill_process_group(self.pid(), Signal::KILL);
            self.ended = Some(self.child.wait()?);
        }
        Ok(self.ended)
    }

    /// Ends every process of the tree and reaps the child.
    pub(crate) fn kill(&mut self) {
        if self.ended.is_some() {
            return;
        }
        // bubblewrap reaps its child when that ends first; the other way round, the orphan would fall to
        // the host's init, which in a container may be us.
        if let Some(init) = &self.sandbox_init {
            let _ = pidfd_send_signal(init, Signal::KILL);
            if matches!(self.wait(Instant::now() + FOLLOW_PATIENCE), Ok(Some(_))) {
                return;
            }
        }
        let descendants = if self.is_sandboxed() {
            Vec::new()
        } else {
            descendants(self.pid())
        };
        let _ = kill_process_group(self.pid(), Signal::KILL);
        let _ = self.child.kill();
        for pid in descendants {
            let _ = kill_process(pid, Signal::KILL);
        }
        if !matches!(self.wait(Instant::now() + KILL_PATIENCE), Ok(Some(_))) {
            tracing::error!(
                pid = self.child.id(),
                "an agent's process did not end after SIGKILL"
            );
        }
    }

    /// Removes what held the tree. After [`Self::kill`] or the end.
    pub(crate) fn clean_up(&mut self) {
        if let Some(mut cgroup) = self.cgroup.take() {
            cgroup.remove();
        }
        if let Some(scratch) = self.scratch.take()
            && let Err(error) = scratch.close()
        {
            tracing::error!(%error, "an agent's scratch folder could not be removed");
        }
    }
}

impl Drop for ProcessTree {
    fn drop(&mut self) {
        self.kill();
        self.clean_up();
    }
}

/// The parent of a process, as the kernel has it now.
fn parent_of(pid: i32) -> Option<i32> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    stat.rsplit_once(')')?
        .1
        .split_whitespace()
        .nth(1)?
        .parse()
        .ok()
}

/// Children, their children and so on, as far as they are still linked to `root`.
pub(crate) fn descendants(root: Pid) -> Vec<Pid> {
    let mut links = Vec::new();
    for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let pid = entry
            .file_name()
            .to_str()
            .and_then(|name| name.parse::<i32>().ok());
        if let Some(pid) = pid
            && let Some(parent) = parent_of(pid)
        {
            links.push((parent, pid));
        }
    }
    let mut found = vec![root.as_raw_nonzero().get()];
    let mut next = 0;
    while let Some(&parent) = found.get(next) {
        found.extend(
            links
                .iter()
                .filter(|link| link.0 == parent)
                .map(|link| link.1),
        );
        next += 1;
    }
    found
        .into_iter()
        .skip(1)
        .filter_map(Pid::from_raw)
        .collect()
}
