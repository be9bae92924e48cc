use crate::{
    AnswerState, CpuReading, Glance, Isolation, Killer, Limits, Looks, OwnWait, ReadLine,
    SandboxError, SpawnError, SpawnSpec, Taken, WriteError,
    cgroup::AgentCgroup,
    command_check::check_command,
    cpu_waits::KnownThreads,
    end::{End, Evidence},
    error::IoContext,
    line_socket::{Closed, LineSocket, wait_for_any},
    next_look::NextLook,
    output_holders,
    prepared::{Prepared, Started},
    process_tree::ProcessTree,
    status_pipe::StatusPipe,
    stderr_tail::StderrTail,
    sweep,
};
use faceoff_types::AgentFaultKind;
use rustix::event::PollFd;
use std::{
    fs,
    sync::Once,
    time::{Duration, Instant},
};

/// How long to wait for the exit status once a channel is closed.
const END_PATIENCE: Duration = Duration::from_millis(500);

/// A running agent. Dropping it kills and reaps the whole tree and removes its cgroup and scratch.
#[derive(Debug)]
pub struct AgentProcess {
    lines: LineSocket,
    output_name: String,
    stderr: StderrTail,
    tree: ProcessTree,
    limits: Limits,
    next_look: NextLook,
    /// Whose waits are read.
    threads: KnownThreads,
    is_frozen: bool,
    end: Option<End>,
}

/// What an agent used, and how it ended.
#[derive(Debug, Clone, Default)]
pub struct Usage {
    /// The most memory the tree had at a time, in bytes; `None` where the host does not tell.
    pub peak_memory_bytes: Option<u64>,
    /// CPU time of the tree in seconds; `None` where the host does not tell.
    pub cpu_time_s: Option<f64>,
    /// The end of standard error, lossy UTF-8.
    pub stderr_tail: String,
    /// How it ended by itself, unless with status 0; `None` also when it had to be killed.
    pub exit: Option<AgentFaultKind>,
}

impl AgentProcess {
    /// Starts the agent. Returns when its sandbox exists; that its program cannot be executed may show
    /// only then, as a closed channel and [`AgentFaultKind::CannotStart`] from [`Self::diagnose_end`].
    ///
    /// # Errors
    /// [`SpawnError::Agent`] if the bundle's command cannot be started, [`SpawnError::Platform`] if the
    /// host lacks a layer that is not given up or something of ours fails.
    pub fn spawn(spec: &SpawnSpec) -> Result<Self, SpawnError> {
        static SWEEP: Once = Once::new();
        if matches!(spec.isolation, Isolation::Sandboxed { .. }) {
            SWEEP.call_once(|| {
                sweep::sweep_stale();
            });
        }
        let bundle_dir = fs::canonicalize(&spec.bundle_dir).context(format_args!(
            "cannot find the bundle {}",
            spec.bundle_dir.display()
        ))?;
        check_command(&bundle_dir, &spec.command, &spec.env).map_err(SpawnError::Agent)?;
        let spec = SpawnSpec {
            bundle_dir,
            ..spec.clone()
        };
        let Started {
            lines,
            output_name,
            stderr,
            tree,
        } = Prepared::new(&spec)?.start(&spec)?;
        Ok(Self {
            lines,
            output_name,
            stderr,
            tree,
            limits: spec.limits,
            next_look: NextLook::first(Instant::now()),
            threads: KnownThreads::default(),
            is_frozen: false,
            end: None,
        })
    }

    /// Sends `line` (which ends in `\n`) without waiting. What the agent leaves no room for follows while its
    /// answer is waited for.
    ///
    /// # Errors
    /// [`WriteError::Closed`] is the agent's doing, the rest is ours.
    pub fn send_line(&mut self, line: &[u8]) -> Result<(), WriteError> {
        // Before the call: on a shared CPU the agent may run, and even answer, before it returns.
        let at = Instant::now();
        match self.lines.send(line) {
            Ok(Ok(())) => {
                self.next_look = NextLook::first(at);
                Ok(())
            }
            Ok(Err(Closed)) => {
                self.diagnose_end(END_PATIENCE)?;
                Err(WriteError::Closed)
            }
            Err(source) => Err(SandboxError::io("cannot write to the agent", source).into()),
        }
    }

    /// Stops the whole tree until [`Self::thaw`]; a tree that is ended is thawed. Tells whether the host has
    /// something that stops it.
    pub fn freeze(&mut self) -> bool {
        let freezer = self.tree.cgroup.as_ref().and_then(AgentCgroup::freezer);
        self.is_frozen = freezer.is_some_and(|freezer| freezer.freeze());
        self.is_frozen
    }

    /// Lets a frozen tree go on.
    pub fn thaw(&mut self) {
        if std::mem::take(&mut self.is_frozen) {
            self.tree.thaw();
        }
    }

    /// Does the host have something that stops the whole tree?
    pub fn can_freeze(&self) -> bool {
        let cgroup = self.tree.cgroup.as_ref();
        cgroup.is_some_and(|cgroup| cgroup.freezer().is_some())
    }

    /// Ends the tree from another thread.
    ///
    /// # Errors
    /// When the host has no descriptor left.
    pub fn killer(&self) -> Result<Killer, SandboxError> {
        self.tree.killer().context("cannot watch over the agent")
    }

    /// Has the channel taken every line that was sent?
    pub const fn has_taken_all(&self) -> bool {
        self.lines.is_all_sent()
    }

    /// Waits for the agent's next line, of at most `max_bytes` without its newline, until `deadline`;
    /// one that has passed takes what is there already.
    ///
    /// # Errors
    /// When the socket or the sandbox itself failed; never for what the agent does.
    pub fn read_line(
        &mut self,
        max_bytes: usize,
        deadline: Instant,
    ) -> Result<ReadLine, SandboxError> {
        let answer = loop {
            let until = self.until_next_look(deadline);
            let answer = self
                .lines
                .read_line(max_bytes, until)
                .context("cannot read from the agent")?;
            if !matches!(answer, ReadLine::TimedOut) || until == deadline {
                break answer;
            }
            if self.output_is_abandoned()? {
                break ReadLine::Closed;
            }
            self.next_look.after_a_longer_pause(Instant::now());
        };
        if matches!(answer, ReadLine::Closed) {
            self.diagnose_end(END_PATIENCE)?;
        }
        Ok(answer)
    }

    /// Looks for the agent's next line until `until` without giving the CPU away, for [`Self::read_line`] to
    /// take: only on a CPU that the agent cannot use.
    ///
    /// # Errors
    /// When the socket itself failed.
    pub fn look_out(&mut self, until: Instant) -> Result<(), SandboxError> {
        self.lines
            .look_out(until)
            .context("cannot read from the agent")
    }

    /// Waits until one of the agents has something for [`Self::read_line`], be it a part of a line or
    /// its end, or until `deadline`. May return early, when an agent's silence is to be looked into:
    /// that, too, `read_line` does, with a deadline that has passed.
    ///
    /// # Errors
    /// When the sockets cannot be waited for.
    pub fn wait_for_any(agents: &[&Self], deadline: Instant) -> Result<(), SandboxError> {
        if agents.iter().any(|agent| agent.lines.holds_line()) {
            return Ok(());
        }
        let until = agents
            .iter()
            .fold(deadline, |until, agent| agent.until_next_look(until));
        let mut awaited: Vec<PollFd<'_>> = agents
            .iter()
            .flat_map(|agent| agent.lines.awaited())
            .collect();
        wait_for_any(&mut awaited, until).context("cannot wait for the agents' output")?;
        Ok(())
    }

    /// Outside of a sandbox a closed output is seen at once.
    fn until_next_look(&self, deadline: Instant) -> Instant {
        if self.tree.is_sandboxed() {
            deadline.min(self.next_look.at)
        } else {
            deadline
        }
    }

    /// Is there unread output already (an answer before the question)?
    ///
    /// # Errors
    /// When the socket cannot be asked.
    pub fn has_pending_output(&mut self) -> Result<bool, SandboxError> {
        self.lines
            .has_pending_output()
            .context("cannot look at the agent's output")
    }

    /// Why it ended, if it ends by itself within `wait`: exit, signal, or the limit that ended it.
    /// `None` while it runs and after we have killed it.
    ///
    /// # Errors
    /// When the end was a failure of ours.
    pub fn diagnose_end(&mut self, wait: Duration) -> Result<Option<AgentFaultKind>, SandboxError> {
        match self.observe_end(wait) {
            Some(End::Agent(fault)) => Ok(Some(fault.clone())),
            Some(End::Platform(why)) => Err(SandboxError::other("the sandbox failed", why.clone())),
            Some(End::Killed) | None => Ok(None),
        }
    }

    /// Last bytes of standard error, lossy UTF-8.
    pub fn stderr_tail(&self) -> String {
        self.stderr.text()
    }

    /// CPU time of the whole tree so far, in seconds: by its cgroup, or where it has none by the clocks
    /// of its processes, which miss what a process used right before its end. `None` where the host
    /// does not tell.
    pub fn cpu_time_s(&self) -> Option<f64> {
        self.tree.cpu_time_s()
    }

    /// Looks up which threads the agent has; nothing is known of others, nor of more than the first few.
    pub fn know_threads(&mut self) {
        if self.counts_cpus() {
            self.threads.update(&self.tree.processes());
        }
    }

    fn counts_cpus(&self) -> bool {
        let cgroup = self.tree.cgroup.as_ref();
        cgroup.is_some_and(|cgroup| cgroup.cpu_evidence.is_some())
    }

    /// The counters of the agent's CPUs, as a look at it; `None` without a cgroup.
    pub fn read_cpus(&self) -> Option<CpuReading> {
        let evidence = self.tree.cgroup.as_ref()?.cpu_evidence.as_ref()?;
        evidence.begin(&self.threads)
    }

    /// The counters before a question, with those of the calling thread if it keeps off the agent's CPUs on `own_cpus`.
    pub fn glance_at_cpus(&self, own_cpus: Option<&[usize]>) -> Glance {
        let cgroup = self.tree.cgroup.as_ref();
        let evidence = cgroup.and_then(|cgroup| cgroup.cpu_evidence.as_ref());
        let stat = if evidence.is_some() || own_cpus.is_some() {
            fs::read_to_string("/proc/stat").unwrap_or_default()
        } else {
            String::new()
        };
        Glance {
            at: Instant::now(),
            cpus: evidence.and_then(|evidence| evidence.glance(&self.threads, &stat)),
            own: own_cpus.map(|cpus| OwnWait::now(&stat, cpus, self.stderr.ran())),
        }
    }

    /// The counters of the calling thread, which may use `cpus`, after a [`Self::glance_at_cpus`].
    pub fn own_wait(&self, cpus: &[usize]) -> OwnWait {
        let stat = fs::read_to_string("/proc/stat").unwrap_or_default();
        OwnWait::now(&stat, cpus, self.stderr.ran())
    }

    /// For how much of the time since `asked`, or since `looks` at it began, or by the `glance` before it was
    /// asked, the agent wanted to run and
    /// could not, because all CPUs that it may use ran something outside of its cgroup, or were held up by a
    /// machine below this one; without either, zero. `None` where the host does not tell. Only waits of a thread
    /// count that then ran, unless the answer is still to come. Never more
    /// than the kernel's counters prove: with version 1 of the cgroup interface in nanoseconds, with version
    /// 2 in ticks of 10 ms, of which a few may be missing. They lag behind by 10 ms at most: so long the
    /// agent must have been waited for when looks begin, and as much, with its age, is taken off since a glance.
    pub fn taken_from_it_since(
        &self,
        asked: Instant,
        looks: Option<&Looks>,
        glance: Option<&CpuReading>,
        answer: AnswerState,
    ) -> Option<Taken> {
        let evidence = self.tree.cgroup.as_ref()?.cpu_evidence.as_ref()?;
        if looks.is_none() && glance.is_none() {
            return Some(Taken::default());
        }
        evidence.taken_since(asked, looks, glance, &self.threads, answer)
    }

    /// Ends the agent's input, waits up to `grace` for it to exit, then kills the tree; always reaps.
    ///
    /// # Errors
    /// When the sandbox failed under the agent.
    pub fn finish(mut self, grace: Duration) -> Result<Usage, SandboxError> {
        self.lines.end_input();
        self.thaw();
        if self.observe_end(grace).is_none() {
            self.kill();
        }
        let usage = Usage {
            peak_memory_bytes: self
                .tree
                .cgroup
                .as_ref()
                .and_then(AgentCgroup::peak_memory_bytes),
            cpu_time_s: self.cpu_time_s(),
            stderr_tail: self.stderr.text(),
            exit: match &self.end {
                Some(End::Agent(fault)) if *fault != (AgentFaultKind::Exited { code: 0 }) => {
                    Some(fault.clone())
                }
                _ => None,
            },
        };
        self.tree.clean_up();
        match &self.end {
            Some(End::Platform(why)) => Err(SandboxError::other("the sandbox failed", why.clone())),
            _ => Ok(usage),
        }
    }

    /// Ends the whole tree now and reaps it.
    pub fn kill(&mut self) {
        if !self.tree.has_ended() {
            self.tree.kill();
            self.end.get_or_insert(End::Killed);
        }
        self.stderr.close();
    }

    /// Has the agent, though alive, closed its output, with nothing left in it?
    fn output_is_abandoned(&self) -> Result<bool, SandboxError> {
        let held =
            output_holders::any_holds(&self.output_name, &self.tree.processes(), self.tree.pid());
        if held {
            return Ok(false);
        }
        let pending = self.lines.has_pending_output();
        Ok(!pending.context("cannot look at the agent's output")?)
    }

    fn observe_end(&mut self, wait: Duration) -> Option<&End> {
        if self.end.is_none() {
            let status = match self.tree.wait(Instant::now() + wait) {
                Ok(status) => status?,
                Err(error) => {
                    self.end = Some(End::Platform(format!("cannot wait for the agent: {error}")));
                    return self.end.as_ref();
                }
            };
            self.stderr.close();
            let evidence = Evidence {
                status,
                sandboxed: self.tree.status.as_mut().map(StatusPipe::exit_code),
                limit_hit: self.tree.cgroup.as_ref().and_then(AgentCgroup::limit_hit),
                stderr: &self.stderr.text(),
                limits: &self.limits,
            };
            self.end = Some(evidence.end());
        }
        self.end.as_ref()
    }
}

impl Drop for AgentProcess {
    /// Whatever else was forgotten: nothing that is shared with an agent is closed while it lives.
    fn drop(&mut self) {
        self.kill();
    }
}
