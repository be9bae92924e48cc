//! The kernel's interface for calls that another process answers: a filter, and the *listener*, a file descriptor that reports the calls.

use rustix::io::Errno;
use seccompiler::BpfProgram;
use std::{
    io,
    mem::MaybeUninit,
    os::fd::{AsFd, AsRawFd, FromRawFd, OwnedFd},
};

/// Installs a filter in the calling process and returns its listener. With `WAIT_KILLABLE_RECV` (Linux 5.19) a call that the answering
/// process has received is not repeated because of a signal.
pub(crate) fn install_with_listener(program: &BpfProgram) -> Result<OwnedFd, Errno> {
    const NEW_LISTENER: libc::c_ulong = 1 << 3;
    const WAIT_KILLABLE_RECV: libc::c_ulong = 1 << 5;
    let filter = libc::sock_fprog {
        len: program.len() as libc::c_ushort,
        filter: program.as_ptr().cast_mut().cast(),
    };
    let install = |flags: libc::c_ulong| {
        #[expect(unsafe_code, reason = "no library installs a filter with a listener")]
        // SAFETY: the kernel reads the program at this address during the call; the new descriptor has no other owner.
        unsafe {
            let fd = libc::syscall(
                libc::SYS_seccomp,
                libc::SECCOMP_SET_MODE_FILTER,
                flags,
                &raw const filter,
            );
            if fd < 0 {
                return Err(last_error());
            }
            Ok(OwnedFd::from_raw_fd(fd as libc::c_int))
        }
    };
    match install(NEW_LISTENER | WAIT_KILLABLE_RECV) {
        Err(Errno::INVAL) => install(NEW_LISTENER),
        result => result,
    }
}

pub(crate) fn receive_call(listener: impl AsFd) -> Result<libc::seccomp_notif, Errno> {
    #[expect(unsafe_code, reason = "the kernel requires a zeroed structure")]
    // SAFETY: the structure consists of integers, for which zero is a value.
    let mut call: libc::seccomp_notif = unsafe { MaybeUninit::zeroed().assume_init() };
    control(listener, NOTIF_RECV, (&raw mut call).cast()).map(|_| call)
}

pub(crate) fn send_reply(
    listener: impl AsFd,
    id: u64,
    reply: Result<i64, Errno>,
) -> Result<(), Errno> {
    let (val, error) = match reply {
        Ok(value) => (value, 0),
        Err(error) => (0, -error.raw_os_error()),
    };
    respond(
        listener,
        libc::seccomp_notif_resp {
            id,
            val,
            error,
            flags: 0,
        },
    )
}

/// Gives the caller a descriptor of the file, which the call returns. `closes_on_exec`: it does not outlive an exec of the caller.
pub(crate) fn send_file(
    listener: impl AsFd,
    id: u64,
    file: impl AsFd,
    closes_on_exec: bool,
) -> Result<(), Errno> {
    let mut request = libc::seccomp_notif_addfd {
        id,
        flags: 0,
        srcfd: file.as_fd().as_raw_fd().cast_unsigned(),
        newfd: 0,
        newfd_flags: if closes_on_exec {
            libc::O_CLOEXEC.cast_unsigned()
        } else {
            0
        },
    };
    // Linux 5.14 could do both in one step. Only `SIGKILL` ends the caller's wait in between, or any signal before 5.19: then it repeats
    // its call, and has one descriptor more.
    let number = control(&listener, NOTIF_ADDFD, (&raw mut request).cast())?;
    send_reply(listener, id, Ok(number.into()))
}

/// Lets the kernel execute the call.
pub(crate) fn let_execute(listener: impl AsFd, id: u64) -> Result<(), Errno> {
    respond(
        listener,
        libc::seccomp_notif_resp {
            id,
            val: 0,
            error: 0,
            flags: EXECUTE,
        },
    )
}

fn respond(listener: impl AsFd, mut response: libc::seccomp_notif_resp) -> Result<(), Errno> {
    control(listener, NOTIF_SEND, (&raw mut response).cast()).map(drop)
}

/// Does the call still wait? Then what was opened by the number of its thread is the thread's.
pub(crate) fn check_waiting(listener: impl AsFd, mut id: u64) -> Result<(), Errno> {
    control(listener, NOTIF_ID_VALID, (&raw mut id).cast()).map(drop)
}

/// Requests of a listener (`SECCOMP_IOCTL_NOTIF_*`): direction, size, type `!` and number.
const NOTIF_RECV: u32 = notification_request(3, size_of::<libc::seccomp_notif>(), 0);
const NOTIF_SEND: u32 = notification_request(3, size_of::<libc::seccomp_notif_resp>(), 1);
const NOTIF_ADDFD: u32 = notification_request(1, size_of::<libc::seccomp_notif_addfd>(), 3);
const NOTIF_ID_VALID: u32 = notification_request(1, size_of::<u64>(), 2);
/// The flag `SECCOMP_USER_NOTIF_FLAG_CONTINUE`.
const EXECUTE: u32 = 1;

const fn notification_request(direction: u32, size: usize, number: u32) -> u32 {
    (direction << 30) | ((size as u32) << 16) | ((b'!' as u32) << 8) | number
}

fn control(
    listener: impl AsFd,
    request: u32,
    argument: *mut libc::c_void,
) -> Result<libc::c_int, Errno> {
    #[expect(unsafe_code, reason = "no library has the requests of a listener")]
    // SAFETY: each caller passes a structure of the size that the request contains, which lives during the call.
    let result = unsafe { libc::ioctl(listener.as_fd().as_raw_fd(), request as _, argument) };
    if result == -1 {
        Err(last_error())
    } else {
        Ok(result)
    }
}

fn last_error() -> Errno {
    Errno::from_io_error(&io::Error::last_os_error()).unwrap_or(Errno::INVAL)
}
