//! Launch of an agent: from a [`SpawnSpec`] to a running process tree.

use crate::{
    Isolation, Layer, SandboxError, SpawnError, SpawnSpec,
    affinity::cpu_set,
    agent_user::AgentUser,
    answered_calls::{CallFilter, CallHandlerSetup},
    bubblewrap::{Bubblewrap, environment},
    cgroup::AgentCgroup,
    channel::Channel,
    child_setup::{ChildSetup, StepReport, rlimits},
    dead_services::SCRATCH_PREFIX,
    error::IoContext,
    line_socket::LineSocket,
    owner::Owner,
    process_tree::ProcessTree,
    protocol_descriptors::ProtocolDescriptors,
    seccomp::Filters,
    spawner,
    status_pipe::StatusPipe,
    stderr_log::StderrLog,
};
use faceoff_types::AgentFaultKind;
use std::{
    fs, io,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

/// Time limit for bubblewrap's set-up of a sandbox. Exceeding it is a platform fault.
const SET_UP_TIMEOUT: Duration = Duration::from_secs(120);

/// A running process tree, and this process's ends of its channel.
pub(crate) struct LaunchedAgent {
    pub lines: LineSocket,
    /// Name of the agent's output in `/proc/*/fd`.
    pub output_name: String,
    pub stderr: StderrLog,
    pub tree: ProcessTree,
}

/// Everything that is created before the fork.
pub(crate) struct Launch {
    command: Command,
    setup: ChildSetup,
    /// Answers some of the agent's system calls.
    call_handler: Option<CallHandlerSetup>,
    channel: Channel,
    /// Reports from bubblewrap; `None` without it.
    status: Option<StatusPipe>,
    cgroup: Option<AgentCgroup>,
    /// The agent's scratch folder on the host; `None` if the sandbox has its own, or there is no sandbox.
    scratch: Option<tempfile::TempDir>,
}

impl Launch {
    /// Creates the channel, the cgroup, the filters and the command line.
    pub(crate) fn new(spec: &SpawnSpec) -> Result<Self, SandboxError> {
        if spec.runtime.root().is_some() && !spec.isolation.enforces(Layer::Namespaces) {
            return Err(SandboxError::Unavailable {
                layer: Layer::Namespaces,
                reason: "the layer is disabled, and the agent is a container image, whose files become its root folder, \
                      which only this layer can do; enable the layer"
                    .to_owned(),
            });
        }
        if spec.logs_output {
            ProtocolDescriptors::reserve()?;
        }
        if spec.isolation == Isolation::None {
            return Self::unsandboxed(spec);
        }
        let enforces = |layer| spec.isolation.enforces(layer);
        let user = AgentUser::for_next_agent()?;
        let channel = Channel::new()?;
        let cgroup = AgentCgroup::create(&spec.limits, &spec.isolation, &spec.cpus)?;
        let is_confined = cgroup.as_ref().is_some_and(|cgroup| cgroup.confines_cpus);
        let (filters, call_filter, call_handler) = if enforces(Layer::Seccomp) {
            let (filter, call_handler) = CallFilter::new(spec)?;
            let has_own_network = enforces(Layer::Namespaces);
            let refuse_affinity_changes = !spec.cpus.is_empty() && !is_confined;
            let filters = Filters::build(has_own_network, refuse_affinity_changes)?;
            (Some(filters), Some(filter), Some(call_handler))
        } else {
            (None, None, None)
        };
        let mut setup = ChildSetup {
            cgroup_procs: cgroup
                .as_ref()
                .map(AgentCgroup::procs_files)
                .transpose()?
                .unwrap_or_default(),
            cpus: (!spec.cpus.is_empty()).then(|| cpu_set(&spec.cpus)),
            rlimits: if enforces(Layer::Rlimits) {
                rlimits(&spec.limits, user.is_some())
            } else {
                Vec::new()
            },
            user,
            call_filter,
            has_usual_umask: true,
            raise_oom_score: true,
            ..ChildSetup::default()
        };
        if enforces(Layer::Namespaces) {
            let (status, writer) = StatusPipe::new().context("cannot make a pipe")?;
            let invocation =
                Bubblewrap::find()?.command(spec, writer, filters.as_ref(), user.is_some())?;
            setup.inherited_fds = invocation.inherited_fds;
            setup.mounts = invocation.mounts;
            setup.network = invocation.network;
            let command = invocation.command;
            return Ok(Self {
                command,
                setup,
                call_handler,
                channel,
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
            call_handler,
            channel,
            status: None,
            cgroup,
            scratch: Some(scratch),
        })
    }

    /// A developer's own agent, without any layer.
    fn unsandboxed(spec: &SpawnSpec) -> Result<Self, SandboxError> {
        let mut command = direct_command(spec);
        command.envs(&spec.env);
        let cpus = (!spec.cpus.is_empty()).then(|| cpu_set(&spec.cpus));
        let setup = ChildSetup {
            cpus,
            ..ChildSetup::default()
        };
        Ok(Self {
            command,
            setup,
            call_handler: None,
            channel: Channel::new()?,
            status: None,
            cgroup: None,
            scratch: None,
        })
    }

    /// Forks, and returns when the sandbox exists.
    pub(crate) fn start(self, spec: &SpawnSpec) -> Result<LaunchedAgent, SpawnError> {
        let Self {
            mut command,
            mut setup,
            call_handler,
            channel,
            status,
            cgroup,
            scratch,
        } = self;
        let Channel {
            lines,
            log,
            agent_fds: [questions, answers, stderr],
            output_name,
        } = channel;
        command.process_group(0);
        if spec.logs_output {
            setup.protocol = Some(ProtocolDescriptors::new(&questions, &answers)?);
            // The agent's standard output goes to its log, too; it gets the protocol by other descriptors.
            let stdout = stderr
                .try_clone()
                .context("cannot pass the agent its log")?;
            command.stdin(Stdio::null()).stdout(stdout);
        } else {
            command.stdin(questions).stdout(answers);
        }
        command.stderr(stderr);
        let is_sandboxed = status.is_some();
        let report = setup.install(&mut command).context("cannot make a pipe")?;
        let child = match spawner::spawn(command) {
            Ok(child) => child,
            Err(source) => return Err(start_failure(report, source, is_sandboxed, spec)),
        };
        const WATCH_ACTION: &str = "cannot watch the agent";
        let mut tree = ProcessTree::new(child, status, cgroup, scratch).context(WATCH_ACTION)?;
        if let Some(call_handler) = call_handler {
            tree.call_handler_thread = Some(call_handler.start()?);
        }
        let mut stderr =
            StderrLog::drain(log, spec.limits.stderr_kept_bytes).context(WATCH_ACTION)?;
        if let Some(status) = &mut tree.status {
            match status.wait_for_child(Instant::now() + SET_UP_TIMEOUT)? {
                Some(init) => tree.watch_init(init),
                None => {
                    tree.kill();
                    stderr.close();
                    let reason = stderr.text().trim().to_owned();
                    return Err(SandboxError::Unavailable {
                        layer: Layer::Namespaces,
                        reason,
                    }
                    .into());
                }
            }
        }
        Ok(LaunchedAgent {
            lines,
            output_name,
            stderr,
            tree,
        })
    }
}

/// The agent's own command, for the modes without bubblewrap.
fn direct_command(spec: &SpawnSpec) -> Command {
    let program = spec.command.first().map(String::as_str).unwrap_or_default();
    let program = match program.strip_prefix("/agent/") {
        // Relative to the working folder, which is entered first: the agent's user may be unable to reach the program
        // by its absolute path.
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

/// Without a mount namespace the agent's user must be able to reach the bundle by its path. If it cannot, this must
/// not look like an agent fault.
fn check_reachable(bundle_dir: &Path) -> Result<(), SandboxError> {
    for folder in bundle_dir.ancestors() {
        let meta = fs::metadata(folder).context("cannot look at the bundle")?;
        if meta.permissions().mode() & 0o001 == 0 {
            return Err(SandboxError::Unavailable {
                layer: Layer::Namespaces,
                reason: format!(
                    "the layer is disabled, so an agent of this root service, which is another user, would have to \
                     reach its bundle through {}, which is closed to others; run the service as an ordinary \
                     user, or enable the layer",
                    folder.display()
                ),
            });
        }
    }
    Ok(())
}

fn scratch_folder(user: Option<AgentUser>) -> Result<tempfile::TempDir, SandboxError> {
    const MAKE_ACTION: &str = "cannot make a scratch folder";
    let folder = tempfile::Builder::new()
        .prefix(&Owner::this_process().name_prefix(SCRATCH_PREFIX))
        .tempdir()
        .context(MAKE_ACTION)?;
    if let Some(user) = user {
        std::os::unix::fs::chown(folder.path(), Some(user.id), Some(user.id))
            .context(MAKE_ACTION)?;
    }
    Ok(folder)
}

/// Classifies a failed spawn. Without bubblewrap, a failed exec is the exec of the agent's program.
fn start_failure(
    report: StepReport,
    source: io::Error,
    is_sandboxed: bool,
    spec: &SpawnSpec,
) -> SpawnError {
    match report.failed_step() {
        Some(step) => SandboxError::io(step, source).into(),
        None if is_sandboxed => SandboxError::io("cannot start bubblewrap", source).into(),
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
