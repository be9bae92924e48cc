//! The processes of one agent: their end awaited, forced, and cleaned up after.

use crate::{
    Killer, cgroup::AgentCgroup, cpu_clock::TreeClock, line_socket::wait_for,
    status_pipe::StatusPipe,
};
use rustix::{
    event::PollFlags,
    process::{Pid, PidfdFlags, Signal, kill_process_group, pidfd_open, pidfd_send_signal},
};
use std::{
    fs, io,
    os::fd::{AsFd, OwnedFd},
    process::{Child, ExitStatus},
    time::{Duration, Instant},
};

/// How long a killed process may take to disappear before we say so and go on.
const KILL_PATIENCE: Duration = Duration::from_secs(60);
/// How long bubblewrap may take to follow the sandbox it watches.
const FOLLOW_PATIENCE: Duration = Duration::from_secs(2);

/// The child, what it started, and what holds them.
#[derive(Debug)]
pub(crate) struct ProcessTree {
    child: Child,
    clock: TreeClock,
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
                clock: TreeClock::new(Pid::from_child(&child)),
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
        let parent = parent_and_group(pid.as_raw_nonzero().get()).map(|(parent, _)| parent);
        if parent == Some(self.pid().as_raw_nonzero().get()) {
            self.sandbox_init = Some(init);
        }
    }

    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// CPU time of the tree so far, seconds.
    pub(crate) fn cpu_time_s(&self) -> Option<f64> {
        self.cgroup
            .as_ref()
            .and_then(AgentCgroup::cpu_time_s)
            .or_else(|| self.clock.cpu_time_s())
    }

    pub(crate) fn is_sandboxed(&self) -> bool {
        self.status.is_some()
    }

    /// Every process of the tree that can be found.
    pub(crate) fn processes(&self) -> Vec<Pid> {
        match &self.cgroup {
            Some(cgroup) => cgroup.processes(),
            None => relatives(self.pid()),
        }
    }

    /// Has everything been reaped?
    pub(crate) fn has_ended(&self) -> bool {
        self.ended.is_some()
    }

    /// Waits for the child's end and reaps it, with what is left of its process group.
    pub(crate) fn wait(&mut self, deadline: Instant) -> io::Result<Option<ExitStatus>> {
        if self.ended.is_none() && wait_for(self.child_end.as_fd(), PollFlags::IN, deadline)? {
            // Not reaped yet, so its number is still its own, and so is the group's.
            self.end_relatives();
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
            self.thaw();
            if matches!(self.wait(Instant::now() + FOLLOW_PATIENCE), Ok(Some(_))) {
                return;
            }
        }
        self.end_relatives();
        let _ = self.child.kill();
        self.thaw();
        if !matches!(self.wait(Instant::now() + KILL_PATIENCE), Ok(Some(_))) {
            tracing::error!(
                pid = self.child.id(),
                "an agent's process did not end after SIGKILL"
            );
        }
    }

    /// Lets the tree go on, if it was frozen.
    pub(crate) fn thaw(&self) {
        if let Some(freezer) = self.cgroup.as_ref().and_then(AgentCgroup::freezer) {
            freezer.thaw();
        }
    }

    /// Ends the tree from other threads.
    pub(crate) fn killer(&self) -> io::Result<Killer> {
        let processes = self.sandbox_init.iter().chain([&self.child_end]);
        let cgroups = self.cgroup.as_ref().map(|cgroup| cgroup.leaves().to_vec());
        Ok(Killer {
            processes: processes
                .map(OwnedFd::try_clone)
                .collect::<io::Result<_>>()?,
            cgroups: cgroups.unwrap_or_default(),
        })
    }

    /// Without a sandbox, whose end is the end of all in it: ends the child's process group and its
    /// descendants, and waits until they are gone. The child itself is only killed.
    fn end_relatives(&self) {
        if self.is_sandboxed() {
            return;
        }
        let ends: Vec<_> = relatives(self.pid())
            .into_iter()
            .filter_map(|pid| pidfd_open(pid, PidfdFlags::empty()).ok())
            .collect();
        let _ = kill_process_group(self.pid(), Signal::KILL);
        for end in &ends {
            let _ = pidfd_send_signal(end, Signal::KILL);
        }
        let deadline = Instant::now() + KILL_PATIENCE;
        for end in &ends {
            if !matches!(wait_for(end.as_fd(), PollFlags::IN, deadline), Ok(true)) {
                tracing::error!(
                    agent = self.child.id(),
                    "a child of an agent did not end after SIGKILL"
                );
            }
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

/// The parent and the process group of a process, as the kernel has them now.
fn parent_and_group(pid: i32) -> Option<(i32, i32)> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in parentheses, may hold anything; the fields after it are plain.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(1);
    Some((fields.next()?.parse().ok()?, fields.next()?.parse().ok()?))
}

/// The other members of `root`'s process group, its children, theirs and so on, as far as they are still
/// linked to it; without `root` itself.
fn relatives(root: Pid) -> Vec<Pid> {
    let root = root.as_raw_nonzero().get();
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let all: Vec<_> = entries
        .filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok())
        .filter_map(|pid| parent_and_group(pid).map(|(parent, group)| (pid, parent, group)))
        .collect();
    let mut found = vec![root];
    found.extend(
        all.iter()
            .filter(|(pid, _, group)| *group == root && *pid != root)
            .map(|(pid, ..)| *pid),
    );
    let mut next = 0;
    while let Some(&parent) = found.get(next) {
        let children = all
            .iter()
            .filter(|(_, its_parent, _)| *its_parent == parent)
            .map(|(pid, ..)| *pid);
        let new: Vec<_> = children.filter(|pid| !found.contains(pid)).collect();
        found.extend(new);
        next += 1;
    }
    found
        .into_iter()
        .skip(1)
        .filter_map(Pid::from_raw)
        .collect()
}
