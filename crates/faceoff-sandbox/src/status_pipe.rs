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
    is_closed: bool,
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
                is_closed: false,
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
            if self.is_closed {
                return Ok(None);
            }
            let is_ready = wait_for(self.pipe.as_fd(), PollFlags::IN, deadline).context(ACTION)?;
            if !is_ready {
                return Err(SandboxError::other(
                    ACTION,
                    "bubblewrap did not set up the sandbox in time",
                ));
            }
            self.fill().context(ACTION)?;
        }
    }

    /// The agent's exit code, if it was started and has ended; 128 + signal after a signal. Valid only after
    /// bubblewrap has ended. An agent that took over the sandbox's first process could state any number, even a negative one; it is the
    /// agent's exit in any case.
    pub(crate) fn exit_code(&mut self) -> Option<i32> {
        while !self.is_closed && matches!(self.fill(), Ok(true)) {}
        self.number("exit-code")
    }

    /// Reads once; `false` if no (more) bytes are available.
    fn fill(&mut self) -> io::Result<bool> {
        let mut chunk = [0; 1024];
        match read(&self.pipe, &mut chunk) {
            Ok(0) => {
                self.is_closed = true;
                Ok(false)
            }
            Ok(count) => {
                self.text.extend(&chunk[..count]);
                self.is_closed |= self.text.len() > MAX_BYTES;
                Ok(true)
            }
            Err(Errno::AGAIN | Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// The integer after `"key":` in the text so far; `None` if it is not complete yet. The JSON documents are flat, and only
    /// bubblewrap writes them, so no parser is needed.
    fn number(&self, key: &str) -> Option<i32> {
        let text = std::str::from_utf8(&self.text).ok()?;
        let rest = text.split_once(&format!("\"{key}\":"))?.1.trim_start();
        let end = rest.find(|c: char| c != '-' && !c.is_ascii_digit())?;
        rest[..end].parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::io::write;

    #[test]
    fn exit_code_of_any_value_is_read() {
        for code in [0, 137, -6, 4096] {
            let (mut status, writer) = StatusPipe::new().unwrap();
            let text = format!("{{ \"child-pid\": 77 }}\n{{ \"exit-code\": {code} }}\n");
            write(&writer, text.as_bytes()).unwrap();
            drop(writer);
            let child = status.wait_for_child(Instant::now()).unwrap();
            assert_eq!(child, Pid::from_raw(77));
            assert_eq!(status.exit_code(), Some(code));
        }
        let (mut ended, writer) = StatusPipe::new().unwrap();
        drop(writer);
        assert_eq!(ended.exit_code(), None);
    }
}
