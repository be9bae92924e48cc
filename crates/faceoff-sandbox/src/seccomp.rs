//! Which system calls an agent may not make.
//!
//! Most filters name what an agent has no use for, each with the answer that programs survive best: not
//! permitted, not there, not for this file, or advice that is taken note of and not followed. One answers
//! `ENOSYS` to everything newer than this list, to `clone3`, whose flags a filter cannot see, and to the
//! x32 calls, which would slip past a list of numbers; programs then take their older way.
//!
//! What agents share, the files of the bundle and the runtime, must not be a notice board: whatever leaves
//! a trace on a file or in the kernel's copy of it, and whatever shows one, is among what is refused.

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
    // a thread with a slice of its own choice lets others go first, and seems to be kept waiting
    libc::SYS_sched_setattr,
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

/// As on a kernel without them (`ENOSYS`).
const ABSENT: &[i64] = &[
    // locks on a file that agents share are seen by all of them; by `fcntl` see below
    libc::SYS_flock,
    // tells what others do with a file
    libc::SYS_inotify_init1,
    // tell what is in memory of a file, and so what others have read
    libc::SYS_mincore,
    CACHESTAT,
    // its slots are counted for the whole host, and the count can be read
    libc::SYS_io_setup,
];

#[cfg(target_arch = "x86_64")]
const ABSENT_HERE: &[i64] = &[libc::SYS_inotify_init];
#[cfg(not(target_arch = "x86_64"))]
const ABSENT_HERE: &[i64] = &[];

/// The same number on all architectures.
const CACHESTAT: i64 = 451;

/// Advice about files, which is all that they are: success, and nothing happens. They would bring a file
/// that agents share into memory, or drop it.
const UNHEEDED: &[i64] = &[libc::SYS_fadvise64, libc::SYS_readahead];
/// The same for a mapping.
const UNHEEDED_ADVICE: [libc::c_int; 3] =
    [libc::MADV_WILLNEED, libc::MADV_COLD, libc::MADV_PAGEOUT];

/// Requests of `fcntl` that are answered as if the kernel did not know them (`EINVAL`). Locks for an agent's
/// own files stay, but nobody is told of another's: not of those by `flock`'s heirs, which `/proc/locks`
/// shows to all, nor by asking for one: `F_GETLK` succeeds and leaves the question as it was, so that whoever asks
/// finds the lock taken, whether it is or not. SQLite asks so where several processes write, and gives up if that
/// fails.
const UNKNOWN_REQUESTS: [libc::c_int; 10] = [
    libc::F_OFD_GETLK,
    libc::F_OFD_SETLK,
    libc::F_OFD_SETLKW,
    libc::F_SETLEASE,
    libc::F_GETLEASE,
    libc::F_NOTIFY,
    // hints about a file's future are kept with the file, and can be read
    RW_HINTS[0],
    RW_HINTS[1],
    RW_HINTS[2],
    RW_HINTS[3],
];
/// `F_GET_RW_HINT`, `F_SET_RW_HINT` and the same for an open file.
const RW_HINTS: [libc::c_int; 4] = [1035, 1036, 1037, 1038];

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

/// The programs, in the order of installation.
#[derive(Debug, Clone)]
pub(crate) struct Filters(Vec<BpfProgram>);

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

impl Filters {
    /// `keep_affinity`: also refuse to change CPU affinity, for hosts where no cpuset holds the agent.
    pub(crate) fn build(keep_affinity: bool) -> Result<Self, SandboxError> {
        let mut rules = whatever_arguments(&[REFUSED, REFUSED_HERE]);
        if keep_affinity {
            rules.insert(libc::SYS_sched_setaffinity, Vec::new());
        }
        rules.insert(libc::SYS_clone, namespace_rules()?);
        // Sockets of one's own only: no family but AF_UNIX, which reaches nothing outside the sandbox
        // (no path of the host is mounted, abstract names belong to the network namespace).
        let not_unix = vec![rule([argument(0, SeccompCmpOp::Ne, libc::AF_UNIX)])?];
        rules.insert(libc::SYS_socket, not_unix.clone());
        rules.insert(libc::SYS_socketpair, not_unix);
        // Pushing input into a terminal.
        let terminal = [libc::TIOCSTI, libc::TIOCLINUX].map(|request| request as libc::c_int);
        rules.insert(libc::SYS_ioctl, one_of(1, &terminal)?);
        // Pages of pipes are counted by user, which an ordinary user's agents share.
        rules.insert(libc::SYS_fcntl, one_of(1, &[libc::F_SETPIPE_SZ])?);

        let mut unheeded = whatever_arguments(&[UNHEEDED]);
        unheeded.insert(libc::SYS_madvise, one_of(2, &UNHEEDED_ADVICE)?);
        unheeded.insert(libc::SYS_fcntl, one_of(1, &[libc::F_GETLK])?);
        // How much of its log may lie unread is not an agent's to say. Libraries ask for room, and do not look.
        let room = [libc::SO_SNDBUF, libc::SO_SNDBUFFORCE].map(|option| {
            rule([
                argument(1, SeccompCmpOp::Eq, libc::SOL_SOCKET),
                argument(2, SeccompCmpOp::Eq, option),
            ])
        });
        let room = room.into_iter().collect::<Result<Vec<_>, _>>()?;
        unheeded.insert(libc::SYS_setsockopt, room);
        let mut unknown_requests = Rules::new();
        unknown_requests.insert(libc::SYS_fcntl, one_of(1, &UNKNOWN_REQUESTS)?);
        // Collapsing pages of a file changes what others find of it.
        unknown_requests.insert(libc::SYS_madvise, one_of(2, &[libc::MADV_COLLAPSE])?);
        // With a flag: only if it is in memory, or so that it does not stay there.
        let flagged = vec![rule([argument(5, SeccompCmpOp::Ne, 0)])?];
        let no_such_reading = Rules::from([(libc::SYS_preadv2, flagged)]);
        Ok(Self(vec![
            unknown_calls(),
            program(whatever_arguments(&[ABSENT, ABSENT_HERE]), libc::ENOSYS)?,
            program(unheeded, 0)?,
            program(unknown_requests, libc::EINVAL)?,
            program(no_such_reading, libc::EOPNOTSUPP)?,
            // The one that refuses `seccomp` itself comes last.
            program(rules, libc::EPERM)?,
        ]))
    }

    /// In the order of installation.
    pub(crate) fn in_order(&self) -> &[BpfProgram] {
        &self.0
    }
}

fn whatever_arguments(lists: &[&[i64]]) -> Rules {
    let calls = lists.iter().copied().flatten();
    calls.map(|&call| (call, Vec::new())).collect()
}

/// The rules of calls that are answered with `errno`; 0 is success.
fn program(rules: Rules, errno: libc::c_int) -> Result<BpfProgram, SandboxError> {
    let arch = TargetArch::try_from(std::env::consts::ARCH).map_err(|error| unavailable(&error))?;
    let answer = SeccompAction::Errno(errno.cast_unsigned());
    SeccompFilter::new(rules, SeccompAction::Allow, answer, arch)
        .and_then(BpfProgram::try_from)
        .map_err(|error| unavailable(&error))
}

/// A comparison of the lower half of an argument.
fn argument(
    index: u8,
    compare: SeccompCmpOp,
    value: libc::c_int,
) -> Result<SeccompCondition, seccompiler::BackendError> {
    let value = u64::from(value.cast_unsigned());
    SeccompCondition::new(index, SeccompCmpArgLen::Dword, compare, value)
}

/// Rules for the argument being any of these.
fn one_of(index: u8, values: &[libc::c_int]) -> Result<Vec<SeccompRule>, SandboxError> {
    let rules = values
        .iter()
        .map(|&value| rule([argument(index, SeccompCmpOp::Eq, value)]));
    rules.collect()
}

fn namespace_rules() -> Result<Vec<SeccompRule>, SandboxError> {
    let rules = NAMESPACE_FLAGS.iter().map(|&flag| {
        let set = SeccompCmpOp::MaskedEq(u64::from(flag.cast_unsigned()));
        rule([argument(0, set, flag)])
    });
    rules.collect()
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
