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
    /// Copies of the ends with numbers above 4, so that [`Self::pass`] overwrites neither of them.
    pub(crate) fn new(questions: &OwnedFd, answers: &OwnedFd) -> Result<Self, SandboxError> {
        let copy_above = |end| fcntl_dupfd_cloexec(end, ANSWERS + 1).context(ACTION);
        Ok(Self {
            questions: copy_above(questions)?,
            answers: copy_above(answers)?,
        })
    }

    /// Reserves both numbers in this process: it opens `/dev/null` under them for good. So no descriptor that an agent's process needs
    /// before its exec has one of them. A file that has one already keeps it, so call this before other threads open and close files.
    pub(crate) fn reserve() -> Result<(), SandboxError> {
        static RESERVED: Mutex<Vec<OwnedFd>> = Mutex::new(Vec::new());
        let mut reserved = RESERVED.lock().unwrap_or_else(PoisonError::into_inner);
        let dev_null =
            open(c"/dev/null", OFlags::RDWR | OFlags::CLOEXEC, Mode::empty()).context(ACTION)?;
        for number in [QUESTIONS, ANSWERS] {
            let lowest_free = fcntl_dupfd_cloexec(&dev_null, number).context(ACTION)?;
            if lowest_free.as_raw_fd() <= ANSWERS {
                reserved.push(lowest_free);
            }
        }
        if dev_null.as_raw_fd() <= ANSWERS {
            reserved.push(dev_null);
        }
        Ok(())
    }

    /// Gives the agent its ends under their numbers. Called between fork and exec.
    pub(crate) fn pass(&self) -> Result<(), Errno> {
        for (end, number) in [(&self.questions, QUESTIONS), (&self.answers, ANSWERS)] {
            #[expect(unsafe_code, reason = "a descriptor is chosen by its number")]
            // SAFETY: the number is not closed here. In this child, whose other descriptors close with the exec, nothing uses what it
            // named.
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
