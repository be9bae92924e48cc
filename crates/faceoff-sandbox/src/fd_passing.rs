//! Refuses file descriptors that an agent sends through the socket of its output. The evaluator has no use for them, and closing
//! one could take long.

use std::os::fd::{AsRawFd, BorrowedFd};

/// The socket option `SO_PASSRIGHTS` of Linux 6.16: does the socket accept file descriptors? On by default.
const PASS_RIGHTS: libc::c_int = 83;

/// Makes the kernel refuse descriptors sent to this socket. Older kernels accept a descriptor and close it when the
/// accompanying bytes are read, which counts as the agent's answer time.
pub(crate) fn disable(socket: BorrowedFd<'_>) {
    let disabled: libc::c_int = 0;
    let size = size_of_val(&disabled) as libc::socklen_t;
    #[expect(unsafe_code, reason = "rustix does not know the option")]
    // SAFETY: the kernel reads the number at this address, and keeps no reference.
    let result = unsafe {
        libc::setsockopt(
            socket.as_raw_fd(),
            libc::SOL_SOCKET,
            PASS_RIGHTS,
            (&raw const disabled).cast(),
            size,
        )
    };
    if result != 0 {
        tracing::debug!("this kernel cannot refuse descriptors sent by agents");
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
    fn sent_descriptor_is_refused_if_the_kernel_can() {
        let (own_end, agent_end) = socketpair(
            AddressFamily::UNIX,
            SocketType::STREAM,
            SocketFlags::CLOEXEC,
            None,
        )
        .unwrap();
        disable(own_end.as_fd());
        let files = [agent_end.as_fd()];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut passed = SendAncillaryBuffer::new(&mut space);
        assert!(passed.push(SendAncillaryMessage::ScmRights(&files)));
        let sent = sendmsg(
            &agent_end,
            &[IoSlice::new(b"x")],
            &mut passed,
            SendFlags::empty(),
        );
        // An older kernel accepts the descriptor.
        assert!(matches!(sent, Err(Errno::PERM) | Ok(1)), "{sent:?}");
    }
}
