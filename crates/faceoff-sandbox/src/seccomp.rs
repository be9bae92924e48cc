//! Which system calls an agent may not make.
//!
//! Two filters. The first names what an agent has no use for (`EPERM`). The second answers `ENOSYS` to
//! everything newer than this list, to `clone3`, whose flags a filter cannot see, and to the x32 calls,
//! which would slip past a list of numbers; programs then take their older way.

use crate::{Layer, SandboxError};
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
    SeccompRule, TargetArch, sock_filter,
};
use std::collections::BTreeMap;

/// Refused whatever their arguments. The reason stands at each group.
const REFUSED: &[i64] = &[
    // other processes' memory and descriptors
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_process_madvise,
    libc::SYS_kcmp,
    libc::SYS_pidfd_getfd,
    libc::SYS_move_pages,
    libc::SYS_migrate_pages,
    // mounts and roots
    libc::SYS_mount,
    libc::SYS_umount2,
    libc::SYS_pivot_root,
    libc::SYS_chroot,
    libc::SYS_move_mount,
    libc::SYS_open_tree,
    libc::SYS_mount_setattr,
    libc::SYS_fsopen,
    libc::SYS_fsconfig,
    libc::SYS_fsmount,
    libc::SYS_fspick,
    // new namespaces would give capabilities over kernel code that is rarely attacked from outside
    libc::SYS_unshare,
    libc::SYS_setns,
    // kernel keyrings are not namespaced
    libc::SYS_keyctl,
    libc::SYS_add_key,
    libc::SYS_request_key,
    // large attack surfaces without a use for an agent
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    libc::SYS_userfaultfd,
    libc::SYS_fanotify_init,
    libc::SYS_seccomp,
    // files by handle, past any mount
    libc::SYS_open_by_handle_at,
    libc::SYS_name_to_handle_at,
    // the machine itself
    libc::SYS_kexec_load,
    libc::SYS_kexec_file_load,
    libc::SYS_reboot,
    libc::SYS_swapon,
    libc::SYS_swapoff,
    libc::SYS_init_module,
    libc::SYS_finit_module,
    libc::SYS_delete_module,
    libc::SYS_acct,
    libc::SYS_quotactl,
    libc::SYS_quotactl_fd,
    libc::SYS_syslog,
    libc::SYS_vhangup,
    libc::SYS_sethostname,
    libc::SYS_setdomainname,
    libc::SYS_settimeofday,
    libc::SYS_clock_settime,
    libc::SYS_adjtimex,
    libc::SYS_clock_adjtime,
    libc::SYS_nfsservctl,
    libc::SYS_lookup_dcookie,
    // personality switches off address-space randomisation
    libc::SYS_personality,
];

#[cfg(target_arch = "x86_64")]
const REFUSED_HERE: &[i64] = &[
    libc::SYS_iopl,
    libc::SYS_ioperm,
    libc::SYS_modify_ldt,
    libc::SYS_uselib,
    libc::SYS_ustat,
    libc::SYS_sysfs,
    libc::SYS__sysctl,
];
#[cfg(not(target_arch = "x86_64"))]
const REFUSED_HERE: &[i64] = &[];

/// `clone` with one of these is `unshare` by another name.
const NAMESPACE_FLAGS: [libc::c_int; 7] = [
    libc::CLONE_NEWNS,
    libc::CLONE_NEWCGROUP,
    libc::CLONE_NEWUTS,
    libc::CLONE_NEWIPC,
    libc::CLONE_NEWUSER,
    libc::CLONE_NEWPID,
    libc::CLONE_NEWNET,
];

/// The newest call that was looked at: `mseal` (Linux 6.10). Numbers are the same on all architectures
/// since 424. Newer ones do not exist for agents until somebody has read what they do.
const NEWEST_KNOWN: u32 = 462;

/// The two programs.
#[derive(Debug, Clone)]
pub(crate) struct Filters {
    refuse: BpfProgram,
    unknown: BpfProgram,
}

impl Filters {
    /// `keep_affinity`: also refuse to change CPU affinity, for hosts where no cpuset holds the agent.
    pub(crate) fn build(keep_affinity: bool) -> Result<Self, SandboxError> {
        let arch =
            TargetArch::try_from(std::env::consts::ARCH).map_err(|error| unavailable(&error))?;
        let mut rules: BTreeMap<i64, Vec<SeccompRule>> = REFUSED
            .iter()
            .chain(REFUSED_HERE)
            .map(|&call| (call, Vec::new()))
            .collect();
        if keep_affinity {
            rules.insert(libc::SYS_sched_setaffinity, Vec::new());
        }
        rules.insert(libc::SYS_clone, namespace_rules()?);
        // Sockets of one's own only: no family but AF_UNIX, which reaches nothing outside the sandbox
        // (no path of the host is mounted, abstract names belong to the network namespace).
        let not_unix = [SeccompCondition::new(
            0,
            SeccompCmpArgLen::Dword,
            SeccompCmpOp::Ne,
            libc::AF_UNIX as u64,
        )];
        let not_unix = vec![rule(not_unix)?];
        rules.insert(libc::SYS_socket, not_unix.clone());
        rules.insert(libc::SYS_socketpair, not_unix);
        // Pushing input into a terminal.
        let mut terminal = Vec::new();
        for request in [libc::TIOCSTI, libc::TIOCLINUX] {
            terminal.push(rule([SeccompCondition::new(
                1,
                SeccompCmpArgLen::Dword,
                SeccompCmpOp::Eq,
                request,
            )])?);
        }
        rules.insert(libc::SYS_ioctl, terminal);
        let refuse = SeccompFilter::new(
            rules,
            SeccompAction::Allow,
            SeccompAction::Errno(libc::EPERM as u32),
            arch,
        )
        .and_then(BpfProgram::try_from)
        .map_err(|error| unavailable(&error))?;
        Ok(Self {
            refuse,
            unknown: unknown_calls(),
        })
    }

    /// In the order of installation: the one that refuses `seccomp` itself comes last.
    pub(crate) fn in_order(&self) -> [&BpfProgram; 2] {
        [&self.unknown, &self.refuse]
    }
}

fn namespace_rules() -> Result<Vec<SeccompRule>, SandboxError> {
    NAMESPACE_FLAGS
        .iter()
        .map(|&flag| {
            let flag = u64::from(flag.cast_unsigned());
            rule([SeccompCondition::new(
                0,
                SeccompCmpArgLen::Dword,
                SeccompCmpOp::MaskedEq(flag),
                flag,
            )])
        })
        .collect()
}

fn rule<const N: usize>(
    conditions: [Result<SeccompCondition, seccompiler::BackendError>; N],
) -> Result<SeccompRule, SandboxError> {
    conditions
        .into_iter()
        .collect::<Result<Vec<_>, _>>()
        .and_then(SeccompRule::new)
        .map_err(|error| unavailable(&error))
}

/// `ENOSYS` for `clone3` and for every number above [`NEWEST_KNOWN`], the x32 ones (bit 30) included. And
/// success, without doing it, for `prctl(PR_SET_PDEATHSIG)`: the agent is its sandbox's first process and
/// could otherwise untie itself from the service, but libraries use the call for their own children, which
/// here end with the agent in any case.
/// The other filter refuses foreign architectures, so this one need not look.
fn unknown_calls() -> BpfProgram {
    const LOAD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const JUMP_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const JUMP_GREATER: u16 = (libc::BPF_JMP | libc::BPF_JGT | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    /// Offsets in `seccomp_data`: the call's number, and the lower half of its first argument (the
    /// filter compiler is for little-endian machines only).
    const NUMBER: u32 = 0;
    const FIRST_ARGUMENT: u32 = 16;
    let step = |code, k| sock_filter {
        code,
        jt: 0,
        jf: 0,
        k,
    };
    let jump = |code, k, jt, jf| sock_filter { code, jt, jf, k };
    vec![
        step(LOAD, NUMBER),
        jump(JUMP_GREATER, NEWEST_KNOWN, 5, 0),
        jump(JUMP_EQUAL, libc::SYS_clone3 as u32, 4, 0),
        jump(JUMP_EQUAL, libc::SYS_prctl as u32, 0, 2),
        step(LOAD, FIRST_ARGUMENT),
        jump(JUMP_EQUAL, libc::PR_SET_PDEATHSIG as u32, 2, 0),
        step(RETURN, libc::SECCOMP_RET_ALLOW),
        step(RETURN, libc::SECCOMP_RET_ERRNO | libc::ENOSYS as u32),
        step(RETURN, libc::SECCOMP_RET_ERRNO),
    ]
}

/// The program as the kernel and bubblewrap read it: an array of `struct sock_filter`.
pub(crate) fn to_bytes(program: &BpfProgram) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(program.len() * 8);
    for instruction in program {
        bytes.extend(instruction.code.to_ne_bytes());
        bytes.extend([instruction.jt, instruction.jf]);
        bytes.extend(instruction.k.to_ne_bytes());
    }
    bytes
}

fn unavailable(error: &dyn std::error::Error) -> SandboxError {
    SandboxError::Unavailable {
        layer: Layer::Seccomp,
        why: format!("no filter for this architecture: {error}"),
    }
}
