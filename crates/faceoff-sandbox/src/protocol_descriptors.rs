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
const ACTION: &str = "cannot reserve file descriptors for the agent's protocol";

/// The agent's ends of the protocol.
#[derive(Debug)]
pub(crate) struct ProtocolDescriptors {
    questions: OwnedFd,
    answers: OwnedFd,
}

impl ProtocolDescriptors {
    /// The ends, moved to other numbers than those that they get.
    pub(crate) fn new(questions: &OwnedFd, answers: &OwnedFd) -> Result<Self, SandboxError> {
        let moved = |end| fcntl_dupfd_cloexec(end, ANSWERS + 1).context(ACTION);
        Ok(Self {
            questions: moved(questions)?,
            answers: moved(answers)?,
        })
    }

    /// Reserves both numbers in this process, so that no descriptor that an agent's process needs before its exec has one of them. What has
    /// them already must keep them: call it before other threads open and close files.
    pub(crate) fn reserve() -> Result<(), SandboxError> {
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

/// Keeps the file descriptors 3 and 4 of this process free for agents whose standard output is their log. Call it first in a program; the
/// start of such an agent calls it, too.
///
/// # Errors
/// When this process may open no further files.
pub fn reserve_protocol_descriptors() -> Result<(), SandboxError> {
    ProtocolDescriptors::reserve()
}
