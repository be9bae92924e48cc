//! Sockets of `NETLINK_ROUTE` for agents, by which programs list network interfaces.
//!
//! Such a socket also shows counters of the neighbour tables of all networks of the host, which any agent can change. So the service makes
//! the socket, in the agent's network, with a filter that passes answers about interfaces and addresses only, and that the agent cannot
//! remove.

use crate::caller::Caller;
use rustix::io::Errno;
use std::{
    io,
    os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, OwnedFd},
};

/// Types of messages that an agent gets: an error, the end of a list, an interface, and an address.
const ANSWERS: [libc::c_int; 4] = [
    libc::NLMSG_ERROR,
    libc::NLMSG_DONE,
    libc::RTM_NEWLINK as libc::c_int,
    libc::RTM_NEWADDR as libc::c_int,
];

/// Makes a socket in the network of the process to which this thread belongs; `never_blocks`: as by `SOCK_NONBLOCK`.
pub(crate) fn make(caller: Caller<'_>, never_blocks: bool) -> io::Result<OwnedFd> {
    let network_namespace = caller.open("ns/net")?;
    // The network belongs to the agent's user namespace, unless a root service has made it.
    let user_namespace = if rustix::process::geteuid().is_root() {
        None
    } else {
        Some(caller.open("ns/user")?)
    };
    let flags = if never_blocks { libc::SOCK_NONBLOCK } else { 0 };
    let kind = libc::SOCK_RAW | libc::SOCK_CLOEXEC | flags;
    let socket = make_in(
        network_namespace.as_fd(),
        user_namespace.as_ref().map(AsFd::as_fd),
        kind,
    )?;
    attach_filter(&socket)?;
    Ok(socket)
}

/// What the process below needs, and its result.
struct SocketRequest {
    network_namespace: libc::c_int,
    /// File descriptor of the user namespace to enter; -1: the process stays in its own.
    user_namespace: libc::c_int,
    kind: libc::c_int,
    /// The socket, or a negative error.
    result: libc::c_int,
}

/// Makes the socket in a process of its own that shares this one's open files: entering a user namespace takes a process with one thread.
fn make_in(
    network_namespace: BorrowedFd<'_>,
    user_namespace: Option<BorrowedFd<'_>>,
    kind: libc::c_int,
) -> io::Result<OwnedFd> {
    const STACK_BYTES: usize = 16 << 10;
    extern "C" fn run(request: *mut libc::c_void) -> libc::c_int {
        #[expect(unsafe_code, reason = "rustix's functions are not callable from here")]
        // SAFETY: the caller's request outlives this process, for whose end it waits. The calls take numbers and neither allocate nor
        // lock.
        unsafe {
            let request = &mut *request.cast::<SocketRequest>();
            let enter = |namespace, kind| namespace < 0 || libc::setns(namespace, kind) == 0;
            let has_entered = enter(request.user_namespace, libc::CLONE_NEWUSER)
                && enter(request.network_namespace, libc::CLONE_NEWNET);
            request.result = if has_entered {
                libc::socket(libc::AF_NETLINK, request.kind, libc::NETLINK_ROUTE)
            } else {
                -1
            };
            if request.result < 0 {
                request.result = -*libc::__errno_location();
            }
        }
        0
    }
    let mut request = SocketRequest {
        network_namespace: network_namespace.as_raw_fd(),
        user_namespace: user_namespace.map_or(-1, |user_namespace| user_namespace.as_raw_fd()),
        kind,
        result: -libc::EINVAL,
    };
    // A stack is aligned to 16 bytes.
    let mut stack = vec![0_u128; STACK_BYTES / size_of::<u128>()];
    // Without a signal at its end, so that no other code of this process waits for it.
    let flags = libc::CLONE_VM | libc::CLONE_VFORK | libc::CLONE_FILES;
    #[expect(unsafe_code, reason = "a fork would copy all tables of this process")]
    // SAFETY: the process runs `run` on a stack of its own, and this thread waits until it has ended. A socket that it made is in the
    // shared table of files and has no other owner.
    unsafe {
        let top = stack.as_mut_ptr_range().end;
        let pid = libc::clone(run, top.cast(), flags, (&raw mut request).cast());
        if pid < 0 || libc::waitpid(pid, std::ptr::null_mut(), libc::__WCLONE) != pid {
            return Err(io::Error::last_os_error());
        }
        if request.result < 0 {
            return Err(Errno::from_raw_os_error(-request.result).into());
        }
        Ok(OwnedFd::from_raw_fd(request.result))
    }
}

/// Lets only the [`ANSWERS`] pass, for good.
fn attach_filter(socket: &OwnedFd) -> io::Result<()> {
    /// Offset of a message's type.
    const TYPE_OFFSET: u32 = 4;
    const LOAD: u16 = (libc::BPF_LD | libc::BPF_H | libc::BPF_ABS) as u16;
    const JUMP_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    let step = |code, k| libc::sock_filter {
        code,
        jt: 0,
        jf: 0,
        k,
    };
    let mut program = vec![step(LOAD, TYPE_OFFSET)];
    let count = ANSWERS.len() as u8;
    for (index, answer) in (0..).zip(ANSWERS) {
        program.push(libc::sock_filter {
            code: JUMP_EQUAL,
            // To the last instruction, which lets the message pass; the one before it drops the message.
            jt: count - index,
            jf: 0,
            // A filter reads numbers with the higher byte first, and the kernel writes this one as the machine does.
            k: u32::from((answer as u16).to_be()),
        });
    }
    program.extend([step(RETURN, 0), step(RETURN, u32::MAX)]);
    let filter = libc::sock_fprog {
        len: program.len() as libc::c_ushort,
        filter: program.as_mut_ptr(),
    };
    let locked: libc::c_int = 1;
    set_option(socket, libc::SO_ATTACH_FILTER, &filter)?;
    set_option(socket, libc::SO_LOCK_FILTER, &locked)
}

fn set_option<T>(socket: &OwnedFd, option: libc::c_int, value: &T) -> io::Result<()> {
    #[expect(unsafe_code, reason = "rustix does not know these options")]
    // SAFETY: the kernel reads a value of this size at this address during the call.
    let result = unsafe {
        libc::setsockopt(
            socket.as_raw_fd(),
            libc::SOL_SOCKET,
            option,
            std::ptr::from_ref(value).cast(),
            size_of::<T>() as libc::socklen_t,
        )
    };
    if result == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}
