//! bubblewrap's status reports: the pid of its child at the start, the child's exit code at the end.

use crate::{SandboxError, error::IoContext, line_socket::wait_for};
use rustix::{
    event::PollFlags,
    io::{Errno, ioctl_fionbio, read},
    pipe::{PipeFlags, pipe_with},
    process::Pid,
};
use std::{
    io,
    os::fd::{AsFd, OwnedFd},
    time::Instant,
};

/// Limit for the two short documents that bubblewrap writes.
const MAX_BYTES: usize = 16 << 10;

/// The reading end of bubblewrap's `--json-status-fd`.
#[derive(Debug)]
pub(crate) struct StatusPipe {
    pipe: OwnedFd,
    text: Vec<u8>,
    closed: bool,
}

impl StatusPipe {
    /// The pipe, and its writing end for bubblewrap to inherit.
    pub(crate) fn new() -> io::Result<(Self, OwnedFd)> {
        let (pipe, writer) = pipe_with(PipeFlags::CLOEXEC)?;
        ioctl_fionbio(&pipe, true)?;
        Ok((
            Self {
                pipe,
                text: Vec::new(),
                closed: false,
            },
            writer,
        ))
    }

    /// Waits for the sandbox's first process. `None` if bubblewrap ended without one.
    pub(crate) fn wait_for_child(
        &mut self,
        deadline: Instant,
    ) -> Result<Option<Pid>, SandboxError> {
        const ACTION: &str = "cannot read bubblewrap's status";
        loop {
            if let Some(pid) = self.number("child-pid") {
                return Ok(Pid::from_raw(pid));
            }
            if self.closed {
                return Ok(None);
            }
            let ready = wait_for(self.pipe.as_fd(), PollFlags::IN, deadline).context(ACTION)?;
            if !ready {
                return Err(SandboxError::other(
                    ACTION,
                    "it did not set up the sandbox in time",
                ));
            }
            self.fill().context(ACTION)?;
        }
    }

    /// The agent's exit code, if it was started and has ended; 128 + signal after a signal. Valid only after
    /// bubblewrap has ended.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        while !self.closed && matches!(self.fill(), Ok(true)) {}
        self.number("exit-code")
    }

    /// Reads once; `false` if no (more) bytes are available.
    fn fill(&mut self) -> io::Result<bool> {
        let mut chunk = [0; 1024];
        match read(&self.pipe, &mut chunk) {
            Ok(0) => {
                self.closed = true;
                Ok(false)
            }
            Ok(count) => {
                self.text.extend(&chunk[..count]);
                self.closed |= self.text.len() > MAX_BYTES;
                Ok(true)
            }
            Err(Errno::AGAIN | Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// The integer after `"key":` in a complete document. The documents are flat, and only bubblewrap writes
    /// them.
    fn number(&self, key: &str) -> Option<i32> {
        let text = std::str::from_utf8(&self.text).ok()?;
        let after = text.split_once(&format!("\"{key}\":"))?.1.trim_start();
        let digits = after.find(|c: char| !c.is_ascii_digit())?;
        after[..digits].parse().ok()
    }
}
