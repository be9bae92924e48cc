//! Seccomp filters: the system calls that an agent may not make.
//!
//! Most filters list calls that an agent does not need. Each list has the answer that programs handle best: not
//! permitted, not implemented, not supported for this file, or success without effect. One filter answers
//! `ENOSYS` to every call newer than this list, to `clone3`, whose flags a filter cannot read, and to the
//! x32 calls, which would bypass a list of numbers. Programs then fall back to older calls.
//!
//! The files that agents share (of the bundle and the runtime) must not be a covert channel between agents. So
//! the refused calls include all that leave a trace on a file or in the page cache, and all that reveal one. The same
//! holds for numbers that the kernel counts for the whole host, as far as a call shows them.

use crate::{Layer, SandboxError};
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter,
    SeccompRule, TargetArch, sock_filter,
};
use std::collections::BTreeMap;

/// Not permitted (`EPERM`) with any arguments. Each group states its reason.
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
    // large attack surfaces that no agent needs
    libc::SYS_bpf,
    libc::SYS_perf_event_open,
    libc::SYS_io_uring_setup,
    libc::SYS_io_uring_enter,
    libc::SYS_io_uring_register,
    libc::SYS_userfaultfd,
    libc::SYS_fanotify_init,
    libc::SYS_seccomp,
    // opening files by handle bypasses mounts
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
    // a thread could choose a time slice with which it yields to others, and seem to wait for the CPU
    libc::SYS_sched_setattr,
    // personality switches off address-space randomisation
    libc::SYS_personality,
];

#[cfg(target_arch = "x86_64")]
const REFUSED_ON_THIS_ARCH: &[i64] = &[
    libc::SYS_iopl,
    libc::SYS_ioperm,
    libc::SYS_modify_ldt,
    libc::SYS_uselib,
    libc::SYS_ustat,
    libc::SYS_sysfs,
    libc::SYS__sysctl,
];
#[cfg(not(target_arch = "x86_64"))]
const REFUSED_ON_THIS_ARCH: &[i64] = &[];

/// Answered as by a kernel that lacks them (`ENOSYS`).
const ABSENT: &[i64] = &[
    // reports other agents' accesses to a file
    libc::SYS_inotify_init1,
    // show which pages of a file are in memory, and so what other agents have read
    libc::SYS_mincore,
    CACHESTAT,
    // slots for asynchronous I/O are counted for the whole host, and every agent can read the count
    libc::SYS_io_setup,
    // the inode numbers of these files are counted for the whole host
    libc::SYS_memfd_create,
    libc::SYS_memfd_secret,
    // the inode number of a process's descriptor is the host's count of processes
    libc::SYS_pidfd_open,
    // show numbers of mounts, which are counted for the whole host
    libc::SYS_statx,
    STATMOUNT,
    LISTMOUNT,
];

/// The numbers of the system calls `statmount` and `listmount`, the same on all architectures.
const STATMOUNT: i64 = 457;
const LISTMOUNT: i64 = 458;

/// Socket options, with their levels, that are answered as if the kernel did not know them: numbers that are counted for the whole host,
/// descriptors of processes, and labels of which the whole host has a limited number.
const UNKNOWN_SOCKET_OPTIONS: [(libc::c_int, libc::c_int); 5] = [
    (libc::SOL_SOCKET, libc::SO_COOKIE),
    (libc::SOL_SOCKET, SO_NETNS_COOKIE),
    (libc::SOL_SOCKET, SO_PASSPIDFD),
    (libc::SOL_SOCKET, SO_PEERPIDFD),
    (libc::IPPROTO_IPV6, IPV6_FLOWLABEL_MGR),
];
const IPV6_FLOWLABEL_MGR: libc::c_int = 32;
/// Sizes of sockets' buffers.
const BUFFER_SIZES: [(libc::c_int, libc::c_int); 4] = [
    (libc::SOL_SOCKET, libc::SO_SNDBUF),
    (libc::SOL_SOCKET, libc::SO_SNDBUFFORCE),
    (libc::SOL_SOCKET, libc::SO_RCVBUF),
    (libc::SOL_SOCKET, libc::SO_RCVBUFFORCE),
];
const SO_NETNS_COOKIE: libc::c_int = 71;
const SO_PASSPIDFD: libc::c_int = 76;
const SO_PEERPIDFD: libc::c_int = 77;

/// A request of `ioctl` that is answered as for a file without it: the entropy of the host (`RNDGETENTCNT`).
const UNKNOWN_IOCTL: u32 = 0x8004_5200;
/// Types of requests that are answered in the same way: about namespaces, whose numbers are counted for the whole host, and about a file's
/// place on the disk, or the disk itself, for all file systems (`f`), for XFS (`X`) and for Btrfs.
const UNKNOWN_IOCTL_TYPES: [u32; 4] =
    [0xb7 << 8, (b'f' as u32) << 8, (b'X' as u32) << 8, 0x94 << 8];
/// The bits of a request that are its type.
const IOCTL_TYPE_MASK: u32 = 0xff00;

#[cfg(target_arch = "x86_64")]
const ABSENT_ON_THIS_ARCH: &[i64] = &[libc::SYS_inotify_init];
#[cfg(not(target_arch = "x86_64"))]
const ABSENT_ON_THIS_ARCH: &[i64] = &[];

/// The number of the system call `cachestat`, the same on all architectures.
const CACHESTAT: i64 = 451;

/// Advice about files: succeeds without effect. The real calls would load a shared file into memory, or drop it.
const IGNORED: &[i64] = &[libc::SYS_fadvise64, libc::SYS_readahead];
/// Advice about mapped files that succeeds without effect, for the same reason.
const IGNORED_ADVICE: [libc::c_int; 3] = [libc::MADV_WILLNEED, libc::MADV_COLD, libc::MADV_PAGEOUT];

/// Commands of `fcntl` that are answered as if the kernel did not know them (`EINVAL`).
///
/// Ordinary locks on an agent's own files work, but no agent can see another's locks. Open file description
/// locks are refused, since `/proc/locks` shows them to all. `F_GETLK` succeeds and leaves its argument
/// unchanged, so every lock seems to be taken. It must not fail: SQLite queries locks this way when several
/// processes write, and stops on an error.
const UNKNOWN_FCNTL_COMMANDS: [libc::c_int; 10] = [
    libc::F_OFD_GETLK,
    libc::F_OFD_SETLK,
    libc::F_OFD_SETLKW,
    libc::F_SETLEASE,
    libc::F_GETLEASE,
    libc::F_NOTIFY,
    // write hints are stored with the file, and every agent can read them
    RW_HINTS[0],
    RW_HINTS[1],
    RW_HINTS[2],
    RW_HINTS[3],
];
/// `F_GET_RW_HINT`, `F_SET_RW_HINT`, and both for an open file description.
const RW_HINTS: [libc::c_int; 4] = [1035, 1036, 1037, 1038];

/// `clone` with one of these flags has the effect of `unshare`.
const NAMESPACE_FLAGS: [libc::c_int; 7] = [
    libc::CLONE_NEWNS,
    libc::CLONE_NEWCGROUP,
    libc::CLONE_NEWUTS,
    libc::CLONE_NEWIPC,
    libc::CLONE_NEWUSER,
    libc::CLONE_NEWPID,
    libc::CLONE_NEWNET,
];

/// Makes `clone` return a descriptor of the new process.
const CLONE_PIDFD: u64 = 0x1000;
/// Lets the kernel merge a process's equal pages with those of others.
const PR_SET_MEMORY_MERGE: libc::c_int = 67;

/// The newest reviewed call: `mseal` (Linux 6.10). Since 424, numbers are the same on all architectures. Newer
/// calls do not exist for agents until a developer has reviewed them.
const NEWEST_KNOWN: u32 = 462;

/// The filter programs in the order of installation.
#[derive(Debug, Clone)]
pub(crate) struct Filters(Vec<BpfProgram>);

type Rules = BTreeMap<i64, Vec<SeccompRule>>;

impl Filters {
    /// `has_own_network`: is the agent in a network namespace of its own? `refuse_affinity_changes`: also refuses to change the CPU
    /// affinity, for hosts where no cpuset confines the agent.
    pub(crate) fn build(
        has_own_network: bool,
        refuse_affinity_changes: bool,
    ) -> Result<Self, SandboxError> {
        let mut not_permitted = any_arguments(&[REFUSED, REFUSED_ON_THIS_ARCH]);
        if refuse_affinity_changes {
            not_permitted.insert(libc::SYS_sched_setaffinity, Vec::new());
        }
        not_permitted.insert(libc::SYS_clone, namespace_rules()?);
        // Local sockets reach nothing outside the sandbox, because no socket path of the host is mounted, and abstract names belong to the
        // network namespace.
        let not_unix = vec![rule([argument(0, SeccompCmpOp::Ne, libc::AF_UNIX)])?];
        not_permitted.insert(libc::SYS_socketpair, not_unix.clone());
        let sockets = if has_own_network {
            refused_sockets()?
        } else {
            not_unix
        };
        not_permitted.insert(libc::SYS_socket, sockets);
        // These requests push input into a terminal.
        let terminal = [libc::TIOCSTI, libc::TIOCLINUX].map(|request| request as libc::c_int);
        not_permitted.insert(libc::SYS_ioctl, one_of(1, &terminal)?);
        // The kernel counts pages of pipes per user, and agents of an unprivileged service share one user.
        not_permitted.insert(libc::SYS_fcntl, one_of(1, &[libc::F_SETPIPE_SZ])?);

        let mut ignored = any_arguments(&[IGNORED]);
        ignored.insert(libc::SYS_madvise, one_of(2, &IGNORED_ADVICE)?);
        ignored.insert(libc::SYS_fcntl, one_of(1, &[libc::F_GETLK])?);
        // An agent must not choose how much of its log can be unread, nor how much of the host's memory for networks its sockets take. The
        // call succeeds without effect: libraries set a buffer size and do not check it.
        let buffer_size = socket_options(&BUFFER_SIZES)?;
        ignored.insert(libc::SYS_setsockopt, buffer_size);
        let mut invalid_argument_rules = Rules::new();
        invalid_argument_rules.insert(libc::SYS_fcntl, one_of(1, &UNKNOWN_FCNTL_COMMANDS)?);
        // Collapsing pages of a file changes its state in memory for other agents. Merged pages show by the time of a write whether
        // another agent has an equal one.
        let advice = [libc::MADV_COLLAPSE, libc::MADV_MERGEABLE];
        invalid_argument_rules.insert(libc::SYS_madvise, one_of(2, &advice)?);
        invalid_argument_rules.insert(libc::SYS_prctl, one_of(0, &[PR_SET_MEMORY_MERGE])?);
        let descriptor_of_process = SeccompCmpOp::MaskedEq(CLONE_PIDFD);
        let with_descriptor = rule([SeccompCondition::new(
            0,
            SeccompCmpArgLen::Dword,
            descriptor_of_process,
            CLONE_PIDFD,
        )])?;
        invalid_argument_rules.insert(libc::SYS_clone, vec![with_descriptor]);
        // An address without a path asks for a name, which older kernels count for the whole host.
        invalid_argument_rules.insert(
            libc::SYS_bind,
            one_of(2, &[size_of::<libc::sa_family_t>() as libc::c_int])?,
        );
        let options = socket_options(&UNKNOWN_SOCKET_OPTIONS)?;
        let unknown_options = Rules::from([
            (libc::SYS_getsockopt, options.clone()),
            (libc::SYS_setsockopt, options),
        ]);
        let mut ioctl_rules = one_of(1, &[UNKNOWN_IOCTL.cast_signed()])?;
        for kind in UNKNOWN_IOCTL_TYPES {
            let is_of_kind = SeccompCmpOp::MaskedEq(u64::from(IOCTL_TYPE_MASK));
            ioctl_rules.push(rule([argument(1, is_of_kind, kind.cast_signed())])?);
        }
        let unknown_ioctls = Rules::from([(libc::SYS_ioctl, ioctl_rules)]);
        // With MSG_FASTOPEN a send call opens a connection without the call `connect`, which the service answers.
        let has_fast_open = SeccompCmpOp::MaskedEq(u64::from(MSG_FASTOPEN.cast_unsigned()));
        let fast_open_in_argument = |index| {
            Ok::<_, SandboxError>(vec![rule([argument(
                index,
                has_fast_open.clone(),
                MSG_FASTOPEN,
            )])?])
        };
        // `preadv2` with flags can read only what is in memory, or keep what it reads out of memory.
        let with_flags = vec![rule([argument(5, SeccompCmpOp::Ne, 0)])?];
        let unsupported_flags = Rules::from([
            (libc::SYS_preadv2, with_flags),
            (libc::SYS_sendto, fast_open_in_argument(3)?),
            (libc::SYS_sendmsg, fast_open_in_argument(2)?),
            (libc::SYS_sendmmsg, fast_open_in_argument(3)?),
        ]);
        Ok(Self(vec![
            filter_unknown_calls(),
            compile(any_arguments(&[ABSENT, ABSENT_ON_THIS_ARCH]), libc::ENOSYS)?,
            compile(ignored, 0)?,
            compile(invalid_argument_rules, libc::EINVAL)?,
            compile(unknown_options, libc::ENOPROTOOPT)?,
            compile(unknown_ioctls, libc::ENOTTY)?,
            compile(unsupported_flags, libc::EOPNOTSUPP)?,
            // Last, because it refuses `seccomp` itself.
            compile(not_permitted, libc::EPERM)?,
        ]))
    }

    /// In the order of installation.
    pub(crate) fn in_order(&self) -> &[BpfProgram] {
        &self.0
    }
}

/// Rules that match these calls with any arguments.
fn any_arguments(lists: &[&[i64]]) -> Rules {
    let calls = lists.iter().copied().flatten();
    calls.map(|&call| (call, Vec::new())).collect()
}

/// The filter that passes calls to the service, which answers them ([`crate::answered_calls`]). `renumbers_cpus`: the agent sees its CPUs
/// numbered from 0, so calls about CPU affinity are passed, too.
pub(crate) fn answered_calls(renumbers_cpus: bool) -> Result<BpfProgram, SandboxError> {
    // The filter compiler cannot express "ask the service", so it is given an unused error number, which is then replaced.
    const PLACEHOLDER: u32 = 4095;
    let affinity: &[i64] = if renumbers_cpus { AFFINITY } else { &[] };
    let mut rules = any_arguments(&[ANSWERED, affinity]);
    let [four, six] = INTERNET;
    rules.insert(libc::SYS_socket, one_of(0, &[four, six, libc::AF_NETLINK])?);
    let mut program = compile(rules, PLACEHOLDER.cast_signed())?;
    for instruction in &mut program {
        if instruction.k == libc::SECCOMP_RET_ERRNO | PLACEHOLDER {
            instruction.k = libc::SECCOMP_RET_USER_NOTIF;
        }
    }
    Ok(program)
}

/// Calls that the service answers in the kernel's place, because the kernel's answer would show numbers of the host or a filter cannot
/// decide.
const ANSWERED: &[i64] = &[
    libc::SYS_statfs,
    libc::SYS_fstatfs,
    libc::SYS_sysinfo,
    libc::SYS_setsid,
    // locks are allowed on the agent's own files only, and the arguments do not show whose file it is
    libc::SYS_flock,
    // a connection within the agent's network makes a further socket
    libc::SYS_connect,
];
/// Calls that contain numbers of CPUs.
const AFFINITY: &[i64] = &[libc::SYS_sched_getaffinity, libc::SYS_sched_setaffinity];

/// A flag of a message.
const MSG_FASTOPEN: libc::c_int = 0x2000_0000;
/// The families of sockets of the internet.
const INTERNET: [libc::c_int; 2] = [libc::AF_INET, libc::AF_INET6];
/// The type of a socket: the lower four bits of the argument. The kernel would load modules for types other than streams and datagrams.
const SOCKET_TYPE: u64 = 0xf;

/// Sockets that are refused. Those of the internet reach the agent's own network only; those of `NETLINK_ROUTE` are made by the service
/// ([`crate::route_sockets`]).
fn refused_sockets() -> Result<Vec<SeccompRule>, SandboxError> {
    let families = [libc::AF_UNIX, libc::AF_NETLINK, INTERNET[0], INTERNET[1]];
    let other = families.map(|family| argument(0, SeccompCmpOp::Ne, family));
    let other_netlink = [
        argument(0, SeccompCmpOp::Eq, libc::AF_NETLINK),
        argument(2, SeccompCmpOp::Ne, libc::NETLINK_ROUTE),
    ];
    let mut rules = vec![rule(other)?, rule(other_netlink)?];
    let allowed_types = [libc::SOCK_STREAM, libc::SOCK_DGRAM];
    let of_type = |kind| argument(1, SeccompCmpOp::MaskedEq(SOCKET_TYPE), kind);
    for family in INTERNET {
        let of_family = || argument(0, SeccompCmpOp::Eq, family);
        for kind in (0..=SOCKET_TYPE as libc::c_int).filter(|kind| !allowed_types.contains(kind)) {
            rules.push(rule([of_family(), of_type(kind)])?);
        }
        for (kind, protocol) in [
            (libc::SOCK_STREAM, libc::IPPROTO_TCP),
            (libc::SOCK_DGRAM, libc::IPPROTO_UDP),
        ] {
            rules.push(rule([
                of_family(),
                of_type(kind),
                argument(2, SeccompCmpOp::Ne, libc::IPPROTO_IP),
                argument(2, SeccompCmpOp::Ne, protocol),
            ])?);
        }
    }
    Ok(rules)
}

/// Compiles a filter that answers the calls of `rules` with `errno`; 0 is success.
fn compile(rules: Rules, errno: libc::c_int) -> Result<BpfProgram, SandboxError> {
    let arch = TargetArch::try_from(std::env::consts::ARCH).map_err(|error| unavailable(&error))?;
    let answer = SeccompAction::Errno(errno.cast_unsigned());
    SeccompFilter::new(rules, SeccompAction::Allow, answer, arch)
        .and_then(BpfProgram::try_from)
        .map_err(|error| unavailable(&error))
}

/// A condition on the lower half of argument number `index`, from 0.
fn argument(
    index: u8,
    compare: SeccompCmpOp,
    value: libc::c_int,
) -> Result<SeccompCondition, seccompiler::BackendError> {
    let value = u64::from(value.cast_unsigned());
    SeccompCondition::new(index, SeccompCmpArgLen::Dword, compare, value)
}

/// Rules that match if argument number `index` is one of `values`.
fn one_of(index: u8, values: &[libc::c_int]) -> Result<Vec<SeccompRule>, SandboxError> {
    let rules = values
        .iter()
        .map(|&value| rule([argument(index, SeccompCmpOp::Eq, value)]));
    rules.collect()
}

/// Rules that match a call with the level and the name of an option of sockets.
fn socket_options(
    options: &[(libc::c_int, libc::c_int)],
) -> Result<Vec<SeccompRule>, SandboxError> {
    let rules = options.iter().map(|&(level, name)| {
        rule([
            argument(1, SeccompCmpOp::Eq, level),
            argument(2, SeccompCmpOp::Eq, name),
        ])
    });
    rules.collect()
}

/// Rules that match `clone` with a flag that creates a namespace.
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

/// Answers `ENOSYS` to `clone3` and to every number above [`NEWEST_KNOWN`], including the x32 calls (bit 30).
///
/// `prctl(PR_SET_PDEATHSIG)` succeeds without effect: the sandbox's first process ends with the service by this signal, and an agent
/// without namespaces could otherwise outlive it. The call must not fail, because libraries use it for their own children, which end with
/// the agent in any case.
///
/// The other filters refuse foreign architectures, so this one does not check the architecture.
fn filter_unknown_calls() -> BpfProgram {
    const LOAD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const JUMP_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const JUMP_GREATER: u16 = (libc::BPF_JMP | libc::BPF_JGT | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    /// Offsets in `seccomp_data`: the call's number, and the lower half of its first argument (the
    /// filter compiler supports little-endian machines only).
    const CALL_NUMBER_OFFSET: u32 = 0;
    const FIRST_ARGUMENT_OFFSET: u32 = 16;
    let step = |code, k| sock_filter {
        code,
        jt: 0,
        jf: 0,
        k,
    };
    // `jt` and `jf`: number of instructions to skip if the comparison is true or false.
    let jump = |code, k, jt, jf| sock_filter { code, jt, jf, k };
    vec![
        step(LOAD, CALL_NUMBER_OFFSET),
        jump(JUMP_GREATER, NEWEST_KNOWN, 5, 0),
        jump(JUMP_EQUAL, libc::SYS_clone3 as u32, 4, 0),
        jump(JUMP_EQUAL, libc::SYS_prctl as u32, 0, 2),
        step(LOAD, FIRST_ARGUMENT_OFFSET),
        jump(JUMP_EQUAL, libc::PR_SET_PDEATHSIG as u32, 2, 0),
        step(RETURN, libc::SECCOMP_RET_ALLOW),
        step(RETURN, libc::SECCOMP_RET_ERRNO | libc::ENOSYS as u32),
        step(RETURN, libc::SECCOMP_RET_ERRNO),
    ]
}

/// The program in the format of the kernel and of bubblewrap: an array of `struct sock_filter`.
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
        reason: format!("no filter for this architecture: {error}"),
    }
}
