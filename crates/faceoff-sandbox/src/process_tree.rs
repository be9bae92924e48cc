//! The process tree of one agent: waiting for its end, killing and cleaning up.

use crate::{
    Killer, answered_calls::CallHandlerThread, cgroup::AgentCgroup, cpu_clock::TreeClock,
    line_socket::wait_for, status_pipe::StatusPipe,
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

/// How long to wait for a killed process to disappear; then an error is logged.
const KILL_TIMEOUT: Duration = Duration::from_secs(60);
/// How long to wait for bubblewrap to exit after its sandbox has ended.
const BUBBLEWRAP_EXIT_TIMEOUT: Duration = Duration::from_secs(2);

/// How long to wait for the end of the thread that answers system calls. Without namespaces and a cgroup a process may escape the kill, and
/// the thread goes on answering it.
const ANSWER_THREAD_TIMEOUT: Duration = Duration::from_secs(2);

/// The child, its descendants, and the resources that contain them.
#[derive(Debug)]
pub(crate) struct ProcessTree {
    child: Child,
    /// CPU time, for trees without a cgroup.
    clock: TreeClock,
    /// Pidfd (file descriptor of a process) of the child: readable when the child has ended.
    child_pidfd: OwnedFd,
    /// Pidfd of the sandbox's first process, whose end terminates all others in the sandbox.
    sandbox_init: Option<OwnedFd>,
    /// Pid of the sandbox's first process, as the host numbers it (inside it is 1).
    init_pid: Option<Pid>,
    /// Reports of bubblewrap, the program that makes the sandbox; `None` for an agent without namespaces.
    pub(crate) status: Option<StatusPipe>,
    pub(crate) cgroup: Option<AgentCgroup>,
    /// Answers some system calls of the tree (seccomp user notification).
    pub(crate) call_handler_thread: Option<CallHandlerThread>,
    /// The scratch folder on the host, for agents without a mount namespace.
    scratch: Option<tempfile::TempDir>,
    /// Set when the child has been reaped.
    exit_status: Option<ExitStatus>,
}

impl ProcessTree {
    pub(crate) fn new(
        mut child: Child,
        status: Option<StatusPipe>,
        cgroup: Option<AgentCgroup>,
        scratch: Option<tempfile::TempDir>,
    ) -> io::Result<Self> {
        match pidfd_open(Pid::from_child(&child), PidfdFlags::empty()) {
            Ok(child_pidfd) => Ok(Self {
                clock: TreeClock::new(Pid::from_child(&child)),
                child,
                child_pidfd,
                sandbox_init: None,
                init_pid: None,
                status,
                cgroup,
                call_handler_thread: None,
                scratch,
                exit_status: None,
            }),
            Err(error) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(error.into())
            }
        }
    }

    /// Opens the sandbox's first process, unless it has ended already.
    pub(crate) fn watch_init(&mut self, pid: Pid) {
        let Ok(init) = pidfd_open(pid, PidfdFlags::empty()) else {
            return;
        };
        // bubblewrap has only one child. If this process is a child of bubblewrap, it is the right one; otherwise the
        // sandbox has ended, and the pid may belong to an unrelated process.
        let parent = parent_and_group(pid.as_raw_nonzero().get()).map(|(parent, _)| parent);
        if parent == Some(self.pid().as_raw_nonzero().get()) {
            self.sandbox_init = Some(init);
            self.init_pid = Some(pid);
        }
    }

    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// The processes of the tree that are bubblewrap's: its own, and the sandbox's first one.
    pub(crate) fn helpers(&self) -> impl Iterator<Item = Pid> {
        let own = self.is_sandboxed().then(|| self.pid());
        own.into_iter().chain(self.init_pid)
    }

    /// CPU time of the tree so far, in seconds.
    pub(crate) fn cpu_time_s(&self) -> Option<f64> {
        self.cgroup
            .as_ref()
            .and_then(AgentCgroup::cpu_time_s)
            .or_else(|| self.clock.cpu_time_s())
    }

    pub(crate) fn is_sandboxed(&self) -> bool {
        self.status.is_some()
    }

    /// The processes of the tree that can be found; without a cgroup, those besides the child itself.
    pub(crate) fn processes(&self) -> Vec<Pid> {
        match &self.cgroup {
            Some(cgroup) => cgroup.processes(),
            None => group_and_descendants(self.pid()),
        }
    }

    /// Has the child been reaped?
    pub(crate) fn has_ended(&self) -> bool {
        self.exit_status.is_some()
    }

    /// Waits for the child's end, kills the rest of its process group, and reaps the child.
    pub(crate) fn wait(&mut self, deadline: Instant) -> io::Result<Option<ExitStatus>> {
        if self.exit_status.is_none()
            && wait_for(self.child_pidfd.as_fd(), PollFlags::IN, deadline)?
        {
            // The child is not reaped yet, so its pid and its process group id cannot have been reused.
            self.kill_group_and_descendants();
            self.exit_status = Some(self.child.wait()?);
            self.end_sandbox();
        }
        Ok(self.exit_status)
    }

    /// Ends the sandbox's first process, and with it all others, after bubblewrap has ended with the agent. The kernel would do it, too,
    /// but a moment later.
    fn end_sandbox(&self) {
        let Some(init) = &self.sandbox_init else {
            return;
        };
        let _ = pidfd_send_signal(init, Signal::KILL);
        self.thaw();
        let deadline = Instant::now() + KILL_TIMEOUT;
        if !matches!(wait_for(init.as_fd(), PollFlags::IN, deadline), Ok(true)) {
            tracing::error!(
                pid = self.child.id(),
                "an agent's sandbox did not end after SIGKILL"
            );
        }
    }

    /// Kills every process of the tree and reaps the child.
    pub(crate) fn kill(&mut self) {
        if self.exit_status.is_some() {
            return;
        }
        // Kill the sandbox's first process before bubblewrap, which then reaps it. In the other order the orphan would
        // be reparented to init, which in a container may be this service.
        if let Some(init) = &self.sandbox_init {
            let _ = pidfd_send_signal(init, Signal::KILL);
            self.thaw();
            if matches!(
                self.wait(Instant::now() + BUBBLEWRAP_EXIT_TIMEOUT),
                Ok(Some(_))
            ) {
                return;
            }
        }
        self.kill_group_and_descendants();
        let _ = self.child.kill();
        self.thaw();
        if !matches!(self.wait(Instant::now() + KILL_TIMEOUT), Ok(Some(_))) {
            tracing::error!(
                pid = self.child.id(),
                "an agent's process did not end after SIGKILL"
            );
        }
    }

    /// Thaws the tree if it was frozen.
    pub(crate) fn thaw(&self) {
        if let Some(freezer) = self.cgroup.as_ref().and_then(AgentCgroup::freezer) {
            freezer.thaw();
        }
    }

    /// A handle that kills the tree from other threads.
    pub(crate) fn killer(&self) -> io::Result<Killer> {
        let processes = self.sandbox_init.iter().chain([&self.child_pidfd]);
        let cgroups = self.cgroup.as_ref().map(|cgroup| cgroup.leaves().to_vec());
        Ok(Killer {
            processes: processes
                .map(OwnedFd::try_clone)
                .collect::<io::Result<_>>()?,
            cgroups: cgroups.unwrap_or_default(),
        })
    }

    /// Kills the child's process group and descendants, and waits for their end; the child itself is not reaped. Does
    /// nothing with a sandbox, where the end of the first process terminates all others.
    fn kill_group_and_descendants(&self) {
        if self.is_sandboxed() {
            return;
        }
        let pidfds: Vec<_> = group_and_descendants(self.pid())
            .into_iter()
            .filter_map(|pid| pidfd_open(pid, PidfdFlags::empty()).ok())
            .collect();
        let _ = kill_process_group(self.pid(), Signal::KILL);
        for pidfd in &pidfds {
            let _ = pidfd_send_signal(pidfd, Signal::KILL);
        }
        let deadline = Instant::now() + KILL_TIMEOUT;
        for pidfd in &pidfds {
            if !matches!(wait_for(pidfd.as_fd(), PollFlags::IN, deadline), Ok(true)) {
                tracing::error!(
                    agent = self.child.id(),
                    "a child of an agent did not end after SIGKILL"
                );
            }
        }
    }

    /// Removes the cgroup and the scratch folder. Call it after [`Self::kill`] or the child's end.
    pub(crate) fn clean_up(&mut self) {
        if let Some(mut cgroup) = self.cgroup.take() {
            cgroup.remove();
        }
        if let Some(thread) = self.call_handler_thread.take() {
            thread.join(Instant::now() + ANSWER_THREAD_TIMEOUT);
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

/// Current parent and process group of a process.
fn parent_and_group(pid: i32) -> Option<(i32, i32)> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in parentheses, may contain spaces and parentheses; the fields after it contain neither.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(1);
    Some((fields.next()?.parse().ok()?, fields.next()?.parse().ok()?))
}

/// The other members of `root`'s process group, and the descendants that are found from parent to child, without `root` itself. A process
/// in a group of its own whose parent has ended is not found.
fn group_and_descendants(root: Pid) -> Vec<Pid> {
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
            .filter(|(_, parent_of_pid, _)| *parent_of_pid == parent)
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
