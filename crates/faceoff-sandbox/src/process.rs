//! A running agent: questions and answers, measurements of its CPUs, and its end.

use crate::{
    AnswerState, CounterBaseline, CpuReading, CpuSamples, EvaluatorCounters, HostInterference,
    Isolation, Killer, Limits, ReadLine, SandboxError, SpawnError, SpawnSpec, WriteError,
    cgroup::AgentCgroup,
    command_check::check_command,
    dead_services::remove_remains_of_dead_services,
    error::IoContext,
    exit_cause::{ExitCause, ExitReport},
    launch::{Launch, LaunchedAgent},
    line_socket::{Closed, LineSocket, wait_for_any},
    open_output,
    output_check_schedule::OutputCheckSchedule,
    process_tree::ProcessTree,
    status_pipe::StatusPipe,
    stderr_log::StderrLog,
    thread_waits::TrackedThreads,
};
use faceoff_types::AgentFaultKind;
use rustix::event::PollFd;
use std::{
    fs,
    sync::Once,
    time::{Duration, Instant},
};

/// How long to wait for the exit status once a channel is closed.
const EXIT_TIMEOUT: Duration = Duration::from_millis(500);

/// A running agent. Dropping it kills and reaps the whole tree and removes its cgroup and scratch folder.
#[derive(Debug)]
pub struct AgentProcess {
    lines: LineSocket,
    /// Name of the agent's output in `/proc/PID/fd`, such as `socket:[123]`, by which it is found whether a process still has it open.
    output_name: String,
    stderr: StderrLog,
    tree: ProcessTree,
    limits: Limits,
    /// When to check next whether the agent has closed its output.
    output_checks: OutputCheckSchedule,
    /// The threads whose scheduling counters are read.
    threads: TrackedThreads,
    is_frozen: bool,
    /// What may be missing for the start of the program, for the error if it fails.
    start_hint: Option<String>,
    end: Option<ExitCause>,
}

/// Resource usage and exit of an agent.
#[derive(Debug, Clone, Default)]
pub struct Usage {
    /// Peak memory of the tree, in bytes; `None` if the host does not report it.
    pub peak_memory_bytes: Option<u64>,
    /// CPU time of the tree in seconds; `None` if the host does not report it.
    pub cpu_time_s: Option<f64>,
    /// The beginning and the end of standard error, lossy UTF-8.
    pub stderr: String,
    /// How it ended on its own, if not with status 0. `None` also if the service killed it.
    pub exit: Option<AgentFaultKind>,
}

impl AgentProcess {
    /// Starts the agent. Returns when its sandbox exists. A program that cannot be executed may fail only later:
    /// with a closed channel and [`AgentFaultKind::CannotStart`] from [`Self::diagnose_end`].
    ///
    /// # Errors
    /// [`SpawnError::Agent`] if the bundle's command cannot be started, [`SpawnError::Platform`] if the
    /// host lacks a layer that is not disabled, or the sandbox cannot be set up.
    pub fn spawn(spec: &SpawnSpec) -> Result<Self, SpawnError> {
        static REMAINS_REMOVED: Once = Once::new();
        if matches!(spec.isolation, Isolation::Sandboxed { .. }) {
            REMAINS_REMOVED.call_once(|| {
                remove_remains_of_dead_services();
            });
        }
        let bundle_dir = fs::canonicalize(&spec.bundle_dir).context(format_args!(
            "cannot find the bundle {}",
            spec.bundle_dir.display()
        ))?;
        let start_hint = check_command(&bundle_dir, &spec.command, &spec.env, &spec.runtime)
            .map_err(SpawnError::Agent)?;
        let spec = SpawnSpec {
            bundle_dir,
            ..spec.clone()
        };
        let LaunchedAgent {
            lines,
            output_name,
            stderr,
            tree,
        } = Launch::new(&spec)?
            .start(&spec)
            .map_err(|error| match error {
                SpawnError::Agent(fault) => SpawnError::Agent(with_start_hint(fault, &start_hint)),
                platform => platform,
            })?;
        Ok(Self {
            lines,
            output_name,
            stderr,
            tree,
            limits: spec.limits,
            output_checks: OutputCheckSchedule::start(Instant::now()),
            threads: TrackedThreads::default(),
            is_frozen: false,
            start_hint,
            end: None,
        })
    }

    /// Sends `line` (which ends in `\n`) without blocking. Bytes that do not fit into the agent's input are sent while
    /// the caller waits for the answer.
    ///
    /// # Errors
    /// [`WriteError::Closed`] is an agent fault, the others are platform faults.
    pub fn send_line(&mut self, line: &[u8]) -> Result<(), WriteError> {
        // The time is taken before the call: on a shared CPU the agent may run, and even answer, before it returns.
        let sent_at = Instant::now();
        match self.lines.send(line) {
            Ok(Ok(())) => {
                self.output_checks = OutputCheckSchedule::start(sent_at);
                Ok(())
            }
            Ok(Err(Closed)) => {
                self.diagnose_end(EXIT_TIMEOUT)?;
                Err(WriteError::Closed)
            }
            Err(source) => Err(SandboxError::io("cannot write to the agent", source).into()),
        }
    }

    /// Freezes the whole tree until [`Self::thaw`]; killing the tree also thaws it. Returns whether the host can
    /// freeze it.
    pub fn freeze(&mut self) -> bool {
        let freezer = self.tree.cgroup.as_ref().and_then(AgentCgroup::freezer);
        self.is_frozen = freezer.is_some_and(|freezer| freezer.freeze());
        self.is_frozen
    }

    /// Thaws a frozen tree.
    pub fn thaw(&mut self) {
        if std::mem::take(&mut self.is_frozen) {
            self.tree.thaw();
        }
    }

    /// Can the host freeze the whole tree?
    pub fn can_freeze(&self) -> bool {
        let cgroup = self.tree.cgroup.as_ref();
        cgroup.is_some_and(|cgroup| cgroup.freezer().is_some())
    }

    /// A handle that kills the tree from another thread.
    ///
    /// # Errors
    /// When the host has no descriptor left.
    pub fn killer(&self) -> Result<Killer, SandboxError> {
        self.tree.killer().context("cannot watch over the agent")
    }

    /// Has the channel accepted all bytes of all sent lines?
    pub const fn is_all_sent(&self) -> bool {
        self.lines.is_all_sent()
    }

    /// Waits until `deadline` for the agent's next line, of at most `max_bytes` without its newline. With an expired
    /// deadline it returns a line that is available already.
    ///
    /// # Errors
    /// When the socket or the sandbox failed; never because of the agent's behaviour.
    pub fn read_line(
        &mut self,
        max_bytes: usize,
        deadline: Instant,
    ) -> Result<ReadLine, SandboxError> {
        let answer = loop {
            let next_wake = self.next_poll_or_deadline(deadline);
            let answer = self
                .lines
                .read_line(max_bytes, next_wake)
                .context("cannot read from the agent")?;
            if !matches!(answer, ReadLine::TimedOut) || next_wake == deadline {
                break answer;
            }
            if self.output_is_abandoned()? {
                break ReadLine::Closed;
            }
            self.output_checks.lengthen(Instant::now());
        };
        if matches!(answer, ReadLine::Closed) {
            self.diagnose_end(EXIT_TIMEOUT)?;
        }
        Ok(answer)
    }

    /// Busy-polls until `deadline` for the agent's next line, which [`Self::read_line`] then returns. Use it only on a CPU
    /// that the agent cannot use.
    ///
    /// # Errors
    /// When the socket itself failed.
    pub fn spin_until(&mut self, deadline: Instant) -> Result<(), SandboxError> {
        self.lines
            .spin_until(deadline)
            .context("cannot read from the agent")
    }

    /// Waits until one of the agents has output for [`Self::read_line`] (even a part of a line) or has ended, or until
    /// `deadline`. May return early when a silent agent must be checked; `read_line` with an expired deadline does
    /// this check.
    ///
    /// # Errors
    /// When polling the sockets fails.
    pub fn wait_for_any(agents: &[&Self], deadline: Instant) -> Result<(), SandboxError> {
        if agents.iter().any(|agent| agent.lines.has_line()) {
            return Ok(());
        }
        let next_wake = agents
            .iter()
            .fold(deadline, |wake, agent| agent.next_poll_or_deadline(wake));
        let mut poll_fds: Vec<PollFd<'_>> = agents
            .iter()
            .flat_map(|agent| agent.lines.poll_fds())
            .collect();
        wait_for_any(&mut poll_fds, next_wake).context("cannot wait for the agents' output")?;
        Ok(())
    }

    /// The next check whether the agent has closed its output, or `deadline` if it is earlier. In the sandbox bubblewrap's processes keep
    /// the output open, so the kernel does not report that the agent has closed it. Without a sandbox the kernel does, and no checks are
    /// needed.
    fn next_poll_or_deadline(&self, deadline: Instant) -> Instant {
        if self.tree.is_sandboxed() {
            deadline.min(self.output_checks.next_check_at)
        } else {
            deadline
        }
    }

    /// Is there unread output? Before a question, this is an answer that no question asked for.
    ///
    /// # Errors
    /// When the socket cannot be queried.
    pub fn has_pending_output(&mut self) -> Result<bool, SandboxError> {
        self.lines
            .has_pending_output()
            .context("cannot look at the agent's output")
    }

    /// The agent fault, if the agent ends on its own within `wait`: exit, signal, or the limit that it reached.
    /// `None` while it runs and after [`Self::kill`].
    ///
    /// # Errors
    /// When a platform fault ended it.
    pub fn diagnose_end(&mut self, wait: Duration) -> Result<Option<AgentFaultKind>, SandboxError> {
        match self.observe_end(wait) {
            Some(ExitCause::Agent(fault)) => Ok(Some(fault.clone())),
            Some(ExitCause::Platform(error)) => {
                Err(SandboxError::other("the sandbox failed", error.clone()))
            }
            Some(ExitCause::Killed) | None => Ok(None),
        }
    }

    /// The beginning and the end of standard error, lossy UTF-8.
    pub fn stderr(&self) -> String {
        self.stderr.text()
    }

    /// CPU time of the whole tree so far, in seconds: by its cgroup or, without a cgroup, by the clocks of its processes, which
    /// miss the time that a process used right before its end. `None` if the host does not report it.
    pub fn cpu_time_s(&self) -> Option<f64> {
        self.tree.cpu_time_s()
    }

    /// Updates the list of tracked threads, which is limited to the agent's first few threads.
    pub fn track_threads(&mut self) {
        if self.has_cpu_accounting() {
            self.threads.update(&self.tree.processes());
        }
    }

    fn has_cpu_accounting(&self) -> bool {
        let cgroup = self.tree.cgroup.as_ref();
        cgroup.is_some_and(|cgroup| cgroup.cpu_accounting.is_some())
    }

    /// Reads the counters of the agent's CPUs and threads; `None` without a cgroup.
    pub fn read_cpus(&self) -> Option<CpuReading> {
        let accounting = self.tree.cgroup.as_ref()?.cpu_accounting.as_ref()?;
        accounting.read_cpus(&self.threads)
    }

    /// Reads the counters before a question. `evaluator_cpus`: the CPUs of the calling thread (the evaluator's) if they are disjoint from
    /// the agent's; then its counters are included.
    pub fn read_baseline(&self, evaluator_cpus: Option<&[usize]>) -> CounterBaseline {
        let cgroup = self.tree.cgroup.as_ref();
        let accounting = cgroup.and_then(|cgroup| cgroup.cpu_accounting.as_ref());
        let stat = if accounting.is_some() || evaluator_cpus.is_some() {
            fs::read_to_string("/proc/stat").unwrap_or_default()
        } else {
            String::new()
        };
        CounterBaseline {
            read_at: Instant::now(),
            cpus: accounting
                .and_then(|accounting| accounting.read_cpu_baseline(&self.threads, &stat)),
            evaluator: evaluator_cpus
                .map(|cpus| EvaluatorCounters::read(&stat, cpus, self.stderr.reader_run_time())),
        }
    }

    /// The counters of the calling thread, which may use `cpus`, after [`Self::read_baseline`].
    pub fn evaluator_counters(&self, cpus: &[usize]) -> EvaluatorCounters {
        let stat = fs::read_to_string("/proc/stat").unwrap_or_default();
        EvaluatorCounters::read(&stat, cpus, self.stderr.reader_run_time())
    }

    /// Host interference since the question: the time in which the agent was runnable and could not run, because all
    /// its CPUs ran processes outside of its cgroup, or the hypervisor had stopped them.
    ///
    /// It is measured since the first of `samples`, and since the `cpu_baseline` that was read before the question
    /// (`asked_at`). Without either it is zero; `None` if the host has no such counters. A thread's wait counts only if
    /// the thread then ran, unless the answer is still pending.
    ///
    /// The result never exceeds what the kernel's counters prove. Cgroup version 1 counts in nanoseconds, version 2 in
    /// ticks of 10 ms, of which a few may be missing. Counters lag by up to 10 ms. So samples must begin at least that
    /// long after the question, and the lag and the age of the baseline are subtracted.
    pub fn interference_since(
        &self,
        asked_at: Instant,
        samples: Option<&CpuSamples>,
        cpu_baseline: Option<&CpuReading>,
        answer: AnswerState,
    ) -> Option<HostInterference> {
        let accounting = self.tree.cgroup.as_ref()?.cpu_accounting.as_ref()?;
        if samples.is_none() && cpu_baseline.is_none() {
            return Some(HostInterference::default());
        }
        accounting.interference_since(asked_at, samples, cpu_baseline, &self.threads, answer)
    }

    /// Ends the agent's input, waits up to `grace` for its exit, then kills the tree; always reaps it.
    ///
    /// # Errors
    /// When the sandbox failed.
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
            stderr: self.stderr.text(),
            exit: match &self.end {
                Some(ExitCause::Agent(fault)) if *fault != (AgentFaultKind::Exited { code: 0 }) => {
                    Some(fault.clone())
                }
                _ => None,
            },
        };
        self.tree.clean_up();
        match &self.end {
            Some(ExitCause::Platform(error)) => {
                Err(SandboxError::other("the sandbox failed", error.clone()))
            }
            _ => Ok(usage),
        }
    }

    /// Kills the whole tree and reaps it.
    pub fn kill(&mut self) {
        if !self.tree.has_ended() {
            self.tree.kill();
            self.end.get_or_insert(ExitCause::Killed);
        }
        self.stderr.close();
    }

    /// Has the agent closed its output while it still runs, with no unread output left?
    fn output_is_abandoned(&self) -> Result<bool, SandboxError> {
        let is_open = open_output::is_open_in_tree(
            &self.output_name,
            &self.tree.processes(),
            self.tree.helpers(),
        );
        if is_open {
            return Ok(false);
        }
        let pending = self.lines.has_pending_output();
        Ok(!pending.context("cannot look at the agent's output")?)
    }

    /// Waits at most `wait` for the agent's end, and keeps its cause; `None` while the agent runs.
    fn observe_end(&mut self, wait: Duration) -> Option<&ExitCause> {
        if self.end.is_none() {
            let status = match self.tree.wait(Instant::now() + wait) {
                Ok(status) => status?,
                Err(error) => {
                    self.end = Some(ExitCause::Platform(format!(
                        "cannot wait for the agent: {error}"
                    )));
                    return self.end.as_ref();
                }
            };
            self.stderr.close();
            let report = ExitReport {
                status,
                sandboxed_exit: self.tree.status.as_mut().map(StatusPipe::exit_code),
                exceeded_limit: self
                    .tree
                    .cgroup
                    .as_ref()
                    .and_then(AgentCgroup::exceeded_limit),
                stderr: &self.stderr.text(),
                limits: &self.limits,
            };
            self.end = Some(match report.cause() {
                ExitCause::Agent(fault) => {
                    ExitCause::Agent(with_start_hint(fault, &self.start_hint))
                }
                other => other,
            });
        }
        self.end.as_ref()
    }
}

/// Adds to the fault of a failed start what may be missing.
fn with_start_hint(fault: AgentFaultKind, start_hint: &Option<String>) -> AgentFaultKind {
    match (fault, start_hint) {
        (AgentFaultKind::CannotStart { detail }, Some(hint)) => AgentFaultKind::CannotStart {
            detail: format!("{detail}; {hint}"),
        },
        (fault, _) => fault,
    }
}

impl Drop for AgentProcess {
    /// Kills the agent first, so that no shared socket is closed while it lives.
    fn drop(&mut self) {
        self.kill();
    }
}
