use crate::{
    Isolation, Layer, Limits, ReadLine, SandboxError, SpawnError, SpawnSpec, WriteError,
    affinity::cpu_set,
    agent_user::AgentUser,
    bubblewrap::{Bubblewrap, environment},
    cgroup::AgentCgroup,
    child_setup::{ChildSetup, rlimits},
    command_check::check_command,
    end::{End, Evidence},
    line_pipe::{LinePipe, Written},
    output_holders,
    owner::Owner,
    process_tree::ProcessTree,
    seccomp::Filters,
    spawner,
    status_pipe::StatusPipe,
    stderr_tail::StderrTail,
    sweep::{self, SCRATCH_PREFIX},
};
use faceoff_types::AgentFaultKind;
use std::{
    fs, io,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Once,
    time::{Duration, Instant},
};

/// How long bubblewrap may take to make a sandbox before that is a failure of the host.
const SET_UP_PATIENCE: Duration = Duration::from_secs(20);
/// When to look for the first time whether a silent agent has closed its output; then ever more rarely.
const FIRST_LOOK: Duration = Duration::from_millis(100);
/// How long to wait for the exit status once the pipes are closed.
const END_PATIENCE: Duration = Duration::from_millis(500);

/// A running agent. Dropping it kills and reaps the whole tree and removes its cgroup and scratch.
#[derive(Debug)]
pub struct AgentProcess {
    lines: LinePipe,
    stderr: StderrTail,
    tree: ProcessTree,
    limits: Limits,
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
    /// only then, as a closed pipe and [`AgentFaultKind::CannotStart`] from [`Self::diagnose_end`].
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
        let bundle_dir = fs::canonicalize(&spec.bundle_dir).map_err(|source| {
            SandboxError::io(
                format!("cannot find the bundle {}", spec.bundle_dir.display()),
                source,
            )
        })?;
        check_command(&bundle_dir, &spec.command).map_err(SpawnError::Agent)?;
        let spec = SpawnSpec {
            bundle_dir,
            ..spec.clone()
        };
        Prepared::new(&spec)?.start(&spec)
    }

    /// Writes all of `line` (which ends in `\n`) before `deadline`; returns the time right after its
    /// last byte was taken.
    ///
    /// # Errors
    /// [`WriteError::Closed`] and [`WriteError::TimedOut`] are the agent's doing, the rest is ours.
    pub fn write_line(&mut self, line: &[u8], deadline: Instant) -> Result<Instant, WriteError> {
        match self.lines.write(line, deadline) {
            Ok(Written::At(at)) => Ok(at),
            Ok(Written::TimedOut) => Err(WriteError::TimedOut),
            Ok(Written::Closed) => {
                self.check_platform()?;
                Err(WriteError::Closed)
            }
            Err(source) => Err(SandboxError::io("cannot write to the agent", source).into()),
        }
    }

    /// Waits for the agent's next line, of at most `max_bytes` without its newline, until `deadline`.
    ///
    /// # Errors
    /// When the pipe or the sandbox itself failed; never for what the agent does.
    pub fn read_line(
        &mut self,
        max_bytes: usize,
        deadline: Instant,
    ) -> Result<ReadLine, SandboxError> {
        let mut pause = FIRST_LOOK;
        let outcome = loop {
            let until = if self.tree.is_sandboxed() {
                deadline.min(Instant::now() + pause)
            } else {
                deadline
            };
            let outcome = self
                .lines
                .read_line(max_bytes, until)
                .map_err(|source| SandboxError::io("cannot read from the agent", source))?;
            if !matches!(outcome, ReadLine::TimedOut) || until == deadline {
                break outcome;
            }
            if self.output_is_abandoned()? {
                break ReadLine::Closed;
            }
            pause *= 2;
        };
        if matches!(outcome, ReadLine::Closed) {
            self.check_platform()?;
        }
        Ok(outcome)
    }

    /// Is there unread output already (an answer before the question)?
    ///
    /// # Errors
    /// When the pipe cannot be asked.
    pub fn has_pending_output(&mut self) -> Result<bool, SandboxError> {
        self.lines
            .has_pending_output()
            .map_err(|source| SandboxError::io("cannot look at the agent's output", source))
    }

    /// Why it ended, if it ends by itself within `wait`: exit, signal, or the limit that ended it.
    /// `None` while it runs, after we have killed it, and when the end was a failure of ours.
    pub fn diagnose_end(&mut self, wait: Duration) -> Option<AgentFaultKind> {
        match self.observe_end(wait) {
            Some(End::Agent(fault)) => Some(fault.clone()),
            _ => None,
        }
    }

    /// Last bytes of standard error, lossy UTF-8.
    pub fn stderr_tail(&self) -> String {
        self.stderr.text()
    }

    /// CPU time of the whole tree so far, in seconds; `None` where the host does not tell (no cgroup).
    pub fn cpu_time_s(&self) -> Option<f64> {
        self.tree.cgroup.as_ref()?.cpu_time_s()
    }

    /// Closes the agent's input, waits up to `grace` for it to exit, then kills the tree; always reaps.
    ///
    /// # Errors
    /// When the sandbox failed under the agent.
    pub fn finish(mut self, grace: Duration) -> Result<Usage, SandboxError> {
        self.lines.close_input();
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
        match self.end.take() {
            Some(End::Platform(why)) => Err(SandboxError::other("the sandbox failed", why)),
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
            output_holders::any_holds(self.lines.output(), &self.tree.processes(), self.tree.pid());
        if held {
            return Ok(false);
        }
        let pending = self.lines.has_pending_output();
        Ok(!pending
            .map_err(|source| SandboxError::io("cannot look at the agent's output", source))?)
    }

    /// After a closed pipe: was it the sandbox that failed?
    fn check_platform(&mut self) -> Result<(), SandboxError> {
        match self.observe_end(END_PATIENCE) {
            Some(End::Platform(why)) => Err(SandboxError::other("the sandbox failed", why.clone())),
            _ => Ok(()),
        }
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
                trespass: self.tree.cgroup.as_ref().and_then(AgentCgroup::trespass),
                stderr: &self.stderr.text(),
                limits: &self.limits,
            };
            self.end = Some(evidence.end());
        }
        self.end.as_ref()
    }
}

/// What is made before the fork.
struct Prepared {
    command: Command,
    setup: ChildSetup,
    status: Option<StatusPipe>,
    cgroup: Option<AgentCgroup>,
    scratch: Option<tempfile::TempDir>,
}

impl Prepared {
    fn new(spec: &SpawnSpec) -> Result<Self, SandboxError> {
        if spec.isolation == Isolation::None {
            return Ok(Self::unsandboxed(spec));
        }
        let enforces = |layer| spec.isolation.enforces(layer);
        let user = AgentUser::for_next_agent()?;
        let cgroup = AgentCgroup::create(&spec.limits, &spec.isolation, &spec.cpus)?;
        let held_by_cpuset = cgroup.as_ref().is_some_and(|cgroup| cgroup.holds_cpus);
        let filters = if enforces(Layer::Seccomp) {
            Some(Filters::build(!spec.cpus.is_empty() && !held_by_cpuset)?)
        } else {
            None
        };
        let mut setup = ChildSetup {
            cgroup_procs: cgroup
                .as_ref()
                .map(AgentCgroup::entrances)
                .transpose()?
                .unwrap_or_default(),
            cpus: (!spec.cpus.is_empty()).then(|| cpu_set(&spec.cpus)),
            rlimits: if enforces(Layer::Rlimits) {
                rlimits(&spec.limits, user.is_some())
            } else {
                Vec::new()
            },
            user,
            yield_memory: true,
            ..ChildSetup::default()
        };
        if enforces(Layer::Namespaces) {
            let failed = |source| SandboxError::io("cannot make a pipe", source);
            let (status, writer) = StatusPipe::new().map_err(failed)?;
            let invocation =
                Bubblewrap::find()?.command(spec, writer, filters.as_ref(), user.is_some())?;
            setup.inherit = invocation.inherit;
            setup.stage = invocation.stage;
            let command = invocation.command;
            return Ok(Self {
                command,
                setup,
                status: Some(status),
                cgroup,
                scratch: None,
            });
        }
        if user.is_some() {
            check_reachable(&spec.bundle_dir)?;
        }
        setup.filters = filters;
        let scratch = scratch_folder(user)?;
        let mut command = direct_command(spec);
        command
            .env_clear()
            .envs(environment(spec, &scratch.path().display().to_string()));
        Ok(Self {
            command,
            setup,
            status: None,
            cgroup,
            scratch: Some(scratch),
        })
    }

    fn unsandboxed(spec: &SpawnSpec) -> Self {
        let mut command = direct_command(spec);
        command.envs(&spec.env);
        let cpus = (!spec.cpus.is_empty()).then(|| cpu_set(&spec.cpus));
        let setup = ChildSetup {
            cpus,
            ..ChildSetup::default()
        };
        Self {
            command,
            setup,
            status: None,
            cgroup: None,
            scratch: None,
        }
    }

    fn start(self, spec: &SpawnSpec) -> Result<AgentProcess, SpawnError> {
        let Self {
            mut command,
            setup,
            status,
            cgroup,
            scratch,
        } = self;
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        let sandboxed = status.is_some();
        let report = setup
            .install(&mut command)
            .map_err(|source| SandboxError::io("cannot make a pipe", source))?;
        let mut child = match spawner::spawn(command) {
            Ok(child) => child,
            Err(source) => return Err(start_failure(report, source, sandboxed, spec)),
        };
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let failed = |source| SandboxError::io("cannot watch the agent", source);
        let mut tree = ProcessTree::new(child, status, cgroup, scratch).map_err(failed)?;
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(
                SandboxError::other("cannot watch the agent", "its pipes are missing").into(),
            );
        };
        let lines = LinePipe::new(stdin.into(), stdout.into()).map_err(failed)?;
        let mut stderr =
            StderrTail::drain(stderr.into(), spec.limits.stderr_tail_bytes).map_err(failed)?;
        if let Some(status) = &mut tree.status {
            match status.wait_for_child(Instant::now() + SET_UP_PATIENCE)? {
                Some(init) => tree.watch_init(init),
                None => {
                    tree.kill();
                    stderr.close();
                    let why = stderr.text().trim().to_owned();
                    return Err(SandboxError::Unavailable {
                        layer: Layer::Namespaces,
                        why,
                    }
                    .into());
                }
            }
        }
        Ok(AgentProcess {
            lines,
            stderr,
            tree,
            limits: spec.limits.clone(),
            end: None,
        })
    }
}

/// The agent's own command, for the modes without bubblewrap.
fn direct_command(spec: &SpawnSpec) -> Command {
    let program = spec.command.first().map(String::as_str).unwrap_or_default();
    let program = match program.strip_prefix("/agent/") {
        // Relative to the working folder, which is entered before: the agent's user may be unable to reach
        // it by its whole name.
        Some(rest) => Path::new("./").join(rest),
        None if program.contains('/') => Path::new("./").join(program),
        None => PathBuf::from(program),
    };
    let mut command = Command::new(program);
    command
        .args(spec.command.iter().skip(1))
        .current_dir(&spec.bundle_dir);
    command
}

/// Without a mount namespace the agent's user must be able to walk to the bundle. If it cannot, that must
/// not look like a mistake of the bundle's.
fn check_reachable(bundle_dir: &Path) -> Result<(), SandboxError> {
    for folder in bundle_dir.ancestors() {
        let meta = fs::metadata(folder)
            .map_err(|source| SandboxError::io("cannot look at the bundle", source))?;
        if meta.permissions().mode() & 0o001 == 0 {
            return Err(SandboxError::Unavailable {
                layer: Layer::Namespaces,
                why: format!(
                    "it is given up, so an agent of this root service, which is another user, would have to \
                     reach its bundle through {}, which is closed to others; run the service as an ordinary \
                     user, or keep the layer",
                    folder.display()
                ),
            });
        }
    }
    Ok(())
}

fn scratch_folder(user: Option<AgentUser>) -> Result<tempfile::TempDir, SandboxError> {
    let failed = |source| SandboxError::io("cannot make a scratch folder", source);
    let folder = tempfile::Builder::new()
        .prefix(&Owner::this_process().name(SCRATCH_PREFIX))
        .tempdir()
        .map_err(failed)?;
    if let Some(user) = user {
        std::os::unix::fs::chown(folder.path(), Some(user.id), Some(user.id)).map_err(failed)?;
    }
    Ok(folder)
}

/// Without bubblewrap the exec that fails is the agent's.
fn start_failure(
    report: crate::child_setup::StepReport,
    source: io::Error,
    sandboxed: bool,
    spec: &SpawnSpec,
) -> SpawnError {
    match report.failed_step() {
        Some(step) => SandboxError::io(step, source).into(),
        None if sandboxed => SandboxError::io("cannot start bubblewrap", source).into(),
        None if matches!(
            source.raw_os_error(),
            Some(libc::ENOENT | libc::EACCES | libc::ENOEXEC)
        ) =>
        {
            let program = spec.command.first().map(String::as_str).unwrap_or_default();
            SpawnError::Agent(AgentFaultKind::CannotStart {
                detail: format!("`{program}`: {source}"),
            })
        }
        None => SandboxError::io("cannot start the agent", source).into(),
    }
}
