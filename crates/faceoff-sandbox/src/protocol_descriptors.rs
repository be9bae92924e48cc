//! The file descriptors of the protocol for agents whose standard output is their log: 3 for questions, 4 for answers.

use crate::{SandboxError, error::IoContext};
use rustix::{
    fs::{Mode, OFlags, open},
    io::{Errno, dup2, fcntl_dupfd_cloexec},
};
use std::{
    mem::ManuallyDrop,
    os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd},
    sync::{Mutex, PoisonError},
};

const QUESTIONS: RawFd = 3;
const ANSWERS: RawFd = 4;

/// The agent's ends of the protocol.
#[derive(Debug)]
pub(crate) struct ProtocolDescriptors {
    pub questions: OwnedFd,
    pub answers: OwnedFd,
}

impl ProtocolDescriptors {
    /// Reserves both numbers in this process. Call it before anything else is opened for the agent, so that no descriptor that its process
    /// needs before the exec has one of them.
    pub(crate) fn reserve() -> Result<(), SandboxError> {
        const ACTION: &str = "cannot reserve file descriptors for the agent's protocol";
        static RESERVED: Mutex<Vec<OwnedFd>> = Mutex::new(Vec::new());
        let mut reserved = RESERVED.lock().unwrap_or_else(PoisonError::into_inner);
        let empty =
            open(c"/dev/null", OFlags::RDWR | OFlags::CLOEXEC, Mode::empty()).context(ACTION)?;
        for number in [QUESTIONS, ANSWERS] {
            let free = fcntl_dupfd_cloexec(&empty, number).context(ACTION)?;
            if free.as_raw_fd() <= ANSWERS {
                reserved.push(free);
            }
        }
        if empty.as_raw_fd() <= ANSWERS {
            reserved.push(empty);
        }
        Ok(())
    }

    /// Gives the agent its ends under their numbers. Called between fork and exec.
    pub(crate) fn pass(&self) -> Result<(), Errno> {
        for (end, number) in [(&self.questions, QUESTIONS), (&self.answers, ANSWERS)] {
            #[expect(unsafe_code, reason = "a descriptor is chosen by its number")]
            // SAFETY: the number is not closed here. In this child, whose other descriptors close with the exec, nothing uses what it named.
            let mut target = ManuallyDrop::new(unsafe { OwnedFd::from_raw_fd(number) });
            dup2(end, &mut target)?;
        }
        Ok(())
    }
}
