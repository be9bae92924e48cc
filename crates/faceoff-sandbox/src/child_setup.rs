//! Set-up of an agent's process, a child of the *service*, between fork and exec: cgroup, CPUs, mounts, limits, user and filters.

use crate::{
    Limits, agent_user::AgentUser, answered_calls::CallFilter, private_mounts::PrivateMounts,
    private_network::PrivateNetwork, protocol_descriptors::ProtocolDescriptors, seccomp::Filters,
};
use rustix::{
    fs::{Mode, OFlags, open},
    io::{Errno, FdFlags, fcntl_setfd, write},
    pipe::{PipeFlags, pipe_with},
    process::{self, Resource, Rlimit, Signal},
    thread::{CpuSet, sched_setaffinity},
};
use std::{
    io::{self, Read},
    os::{fd::OwnedFd, unix::process::CommandExt},
    process::Command,
};

/// The inputs of the set-up. They are allocated before the fork, because afterwards only system calls are allowed.
#[derive(Debug, Default)]
pub(crate) struct ChildSetup {
    /// `cgroup.procs` files to enter by writing `0`.
    pub cgroup_procs: Vec<OwnedFd>,
    /// CPUs on which the agent may run.
    pub cpus: Option<CpuSet>,
    pub rlimits: Vec<(Resource, Rlimit)>,
    /// Files made reachable for `user`, mounted while the child is still root.
    pub mounts: Option<PrivateMounts>,
    /// The agent's network, made while the child is still root.
    pub network: Option<PrivateNetwork>,
    /// The user that the child becomes.
    pub user: Option<AgentUser>,
    /// The protocol's descriptors, if they are not standard input and output.
    pub protocol: Option<ProtocolDescriptors>,
    /// File descriptors that stay open after the exec.
    pub inherited_fds: Vec<OwnedFd>,
    /// The filter of the calls that the service answers.
    pub call_filter: Option<CallFilter>,
    /// Filters that the child installs itself; used without bubblewrap.
    pub filters: Option<Filters>,
    /// Files that the agent makes have the usual modes, whatever the service's umask.
    pub has_usual_umask: bool,
    /// Makes the agent the first victim of the OOM killer when the host runs out of memory.
    pub raise_oom_score: bool,
}

/// A step of the set-up. The child reports a failed one as one byte.
#[derive(Debug, Clone, Copy)]
enum Step {
    CloseDescriptors,
    EnterCgroup,
    SetCpus,
    MakeMounts,
    MakeNetwork,
    SetRlimits,
    BecomeUser,
    PassDescriptors,
    DieWithParent,
    AnswerCalls,
    InstallFilters,
}

impl Step {
    const ALL: [Self; 11] = [
        Self::CloseDescriptors,
        Self::EnterCgroup,
        Self::SetCpus,
        Self::MakeMounts,
        Self::MakeNetwork,
        Self::SetRlimits,
        Self::BecomeUser,
        Self::PassDescriptors,
        Self::DieWithParent,
        Self::AnswerCalls,
        Self::InstallFilters,
    ];

    fn description(self) -> &'static str {
        match self {
            Self::CloseDescriptors => {
                "cannot close what the service has open (close_range, Linux 5.11, is needed)"
            }
            Self::EnterCgroup => "cannot enter the agent's cgroup",
            Self::SetCpus => "cannot bind the agent to its CPUs",
            Self::MakeMounts => {
                "cannot mount files for the agent's user in a mount namespace (a root service needs \
                 CAP_SYS_ADMIN and CAP_MKNOD; without them, run the service as an ordinary user)"
            }
            Self::MakeNetwork => {
                "cannot make a network namespace for the agent (a root service needs CAP_SYS_ADMIN; without it, run the \
                 service as an ordinary user)"
            }
            Self::SetRlimits => "cannot set the agent's resource limits",
            Self::BecomeUser => "cannot become the agent's user",
            Self::PassDescriptors => "cannot pass descriptors to the agent",
            Self::DieWithParent => "cannot tie the agent to the service",
            Self::AnswerCalls => {
                "cannot install the seccomp filter whose calls the service answers (no other program may have installed one \
                 above this service)"
            }
            Self::InstallFilters => "cannot install the seccomp filter",
        }
    }
}

/// Reports which step failed, after a failed spawn.
#[derive(Debug)]
pub(crate) struct StepReport(OwnedFd);

impl StepReport {
    /// Description of the failed step; `None` if the exec itself failed.
    pub(crate) fn failed_step(self) -> Option<&'static str> {
        let mut byte = [0];
        std::fs::File::from(self.0).read_exact(&mut byte).ok()?;
        Step::ALL
            .iter()
            .find(|step| **step as u8 == byte[0])
            .map(|step| step.description())
    }
}

impl ChildSetup {
    /// Makes `command` run this set-up in its child.
    pub(crate) fn install(mut self, command: &mut Command) -> io::Result<StepReport> {
        let (reader, writer) = pipe_with(PipeFlags::CLOEXEC)?;
        let parent = process::getpid();
        let hook = move || {
            self.run(parent).map_err(|(step, error)| {
                let _ = write(&writer, &[step as u8]);
                io::Error::from(error)
            })
        };
        #[expect(
            unsafe_code,
            reason = "the kernel offers no other moment to enter a cgroup or drop root"
        )]
        // SAFETY: between fork and exec only async-signal-safe work is allowed. `run` makes raw system
        // calls on memory prepared beforehand; it neither allocates nor locks.
        unsafe {
            command.pre_exec(hook);
        }
        Ok(StepReport(reader))
    }

    fn run(&mut self, parent: process::Pid) -> Result<(), (Step, Errno)> {
        close_rest_on_exec().map_err(|error| (Step::CloseDescriptors, error))?;
        if self.has_usual_umask {
            process::umask(Mode::WGRP | Mode::WOTH);
        }
        for procs in &self.cgroup_procs {
            write(procs, b"0").map_err(|error| (Step::EnterCgroup, error))?;
        }
        if let Some(cpus) = &self.cpus {
            sched_setaffinity(None, cpus).map_err(|error| (Step::SetCpus, error))?;
        }
        if self.raise_oom_score {
            // Best effort, since it protects the host and is no limit: some containers hide the file.
            let file = open(
                c"/proc/self/oom_score_adj",
                OFlags::WRONLY | OFlags::CLOEXEC,
                Mode::empty(),
            );
            // The highest score, killed first, is 1000.
            let _ = file.and_then(|file| write(&file, b"800"));
        }
        if let Some(mounts) = &mut self.mounts {
            mounts
                .mount_all()
                .map_err(|error| (Step::MakeMounts, error))?;
        }
        if let Some(network) = &self.network {
            network
                .enter()
                .map_err(|error| (Step::MakeNetwork, error))?;
        }
        for &(resource, limit) in &self.rlimits {
            process::setrlimit(resource, limit).map_err(|error| (Step::SetRlimits, error))?;
        }
        if let Some(user) = self.user {
            user.switch_to()
                .map_err(|error| (Step::BecomeUser, error))?;
        }
        if let Some(protocol) = &self.protocol {
            protocol
                .pass()
                .map_err(|error| (Step::PassDescriptors, error))?;
        }
        for fd in &self.inherited_fds {
            fcntl_setfd(fd, FdFlags::empty()).map_err(|error| (Step::PassDescriptors, error))?;
        }
        // This must follow the change of user, which would clear the signal. If the service died before this call, no signal
        // comes; the parent is then another process.
        process::set_parent_process_death_signal(Some(Signal::KILL))
            .map_err(|error| (Step::DieWithParent, error))?;
        if process::getppid() != Some(parent) {
            return Err((Step::DieWithParent, Errno::SRCH));
        }
        if let Some(filter) = &self.call_filter {
            filter
                .install()
                .map_err(|error| (Step::AnswerCalls, error))?;
        }
        if let Some(filters) = &self.filters {
            for program in filters.in_order() {
                seccompiler::apply_filter(program)
                    .map_err(|error| (Step::InstallFilters, errno_of(&error)))?;
            }
        }
        Ok(())
    }
}

/// Agents must not inherit descriptors that the service was started with or that a library opened without
/// `CLOEXEC`.
fn close_rest_on_exec() -> Result<(), Errno> {
    const FIRST_FD: libc::c_uint = 3;
    #[expect(unsafe_code, reason = "rustix has no close_range")]
    // SAFETY: takes three numbers; it marks descriptors and closes none, so no open descriptor becomes invalid.
    let result = unsafe {
        libc::syscall(
            libc::SYS_close_range,
            FIRST_FD,
            libc::c_uint::MAX,
            libc::CLOSE_RANGE_CLOEXEC,
        )
    };
    if result == 0 {
        return Ok(());
    }
    let error = io::Error::last_os_error();
    Err(Errno::from_io_error(&error).unwrap_or(Errno::INVAL))
}

fn errno_of(error: &seccompiler::Error) -> Errno {
    match error {
        seccompiler::Error::Prctl(source) | seccompiler::Error::Seccomp(source) => {
            Errno::from_io_error(source).unwrap_or(Errno::INVAL)
        }
        _ => Errno::INVAL,
    }
}

/// The resource limits of an agent, each capped at the service's own hard limit. `has_own_user`: no other process runs as the
/// agent's user.
pub(crate) fn rlimits(limits: &Limits, has_own_user: bool) -> Vec<(Resource, Rlimit)> {
    /// Memory that cannot be swapped; the usual default.
    const LOCKED_BYTES: u64 = 8 << 20;
    /// The usual default.
    const STACK_BYTES: u64 = 8 << 20;
    /// Queued signals. Each timer of `timer_create` holds one, so this bounds the timers that can expire at one
    /// instant.
    const PENDING_SIGNALS: u64 = 256;
    /// Not 0: a host that pipes core dumps to a program starts it, as root, even at 0, but not at 1. No dump fits
    /// into 1 byte either.
    const CORE_BYTES: u64 = 1;
    let mut wanted = vec![
        (Resource::Nofile, u64::from(limits.open_files)),
        (Resource::Fsize, limits.file_size_bytes),
        (Resource::Core, CORE_BYTES),
        (Resource::Memlock, LOCKED_BYTES),
        (Resource::Stack, STACK_BYTES),
        (Resource::Sigpending, PENDING_SIGNALS),
        (Resource::Nice, 0),
        (Resource::Rtprio, 0),
    ];
    if has_own_user {
        // The kernel counts this limit per user, so it is useful only if each agent has its own user. It is a
        // little above the cgroup's limit, which must be reached first because it is counted and reported.
        wanted.push((Resource::Nproc, u64::from(limits.pids) + 8));
    }
    wanted
        .into_iter()
        .map(|(resource, value)| {
            let value = process::getrlimit(resource)
                .maximum
                .map_or(value, |maximum| maximum.min(value));
            (
                resource,
                Rlimit {
                    current: Some(value),
                    maximum: Some(value),
                },
            )
        })
        .collect()
}
