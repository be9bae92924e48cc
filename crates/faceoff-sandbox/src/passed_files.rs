//! Open files that an agent passes along with what it writes: nobody takes them, and to close one could be work
//! of the service's.

use std::os::fd::{AsRawFd, BorrowedFd};

/// `SO_PASSRIGHTS` of Linux 6.16, on by default.
const PASS_RIGHTS: libc::c_int = 83;

/// Has whoever sends a file to this socket refused. Older kernels take it and close it when the bytes beside
/// it are read, in the time of the answer.
pub(crate) fn refuse(socket: BorrowedFd<'_>) {
    let off: libc::c_int = 0;
    let size = size_of_val(&off) as libc::socklen_t;
    #[expect(unsafe_code, reason = "rustix does not know the option")]
    // SAFETY: the kernel reads the number at this address, and keeps no reference.
    let set = unsafe {
        libc::setsockopt(
            socket.as_raw_fd(),
            libc::SOL_SOCKET,
            PASS_RIGHTS,
            (&raw const off).cast(),
            size,
        )
    };
    if set != 0 {
        tracing::debug!("this kernel cannot refuse files that agents pass along");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::{
        io::Errno,
        net::{
            AddressFamily, SendAncillaryBuffer, SendAncillaryMessage, SendFlags, SocketFlags,
            SocketType, sendmsg, socketpair,
        },
    };
    use std::{io::IoSlice, mem::MaybeUninit, os::fd::AsFd};

    #[test]
    fn a_passed_file_is_refused_where_the_kernel_can() {
        let (ours, agents) = socketpair(
            AddressFamily::UNIX,
            SocketType::STREAM,
            SocketFlags::CLOEXEC,
            None,
        )
        .unwrap();
        refuse(ours.as_fd());
        let files = [agents.as_fd()];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut passed = SendAncillaryBuffer::new(&mut space);
        assert!(passed.push(SendAncillaryMessage::ScmRights(&files)));
        let sent = sendmsg(
            &agents,
            &[IoSlice::new(b"x")],
            &mut passed,
            SendFlags::empty(),
        );
        // An older kernel takes it.
        assert!(matches!(sent, Err(Errno::PERM) | Ok(1)), "{sent:?}");
    }
}
