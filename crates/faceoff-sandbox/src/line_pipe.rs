//! Lines to and from the agent: capped, deadline-bounded, answers stamped right after their last
//! byte, questions right before theirs.

use rustix::{
    buffer::spare_capacity,
    event::{PollFd, PollFlags, Timespec, poll},
    io::{Errno, ioctl_fionbio, ioctl_fionread, read, write},
};
use std::{
    io,
    os::fd::{AsFd, BorrowedFd, OwnedFd},
    time::Instant,
};

/// One read: a pipe's whole content, so that an answer costs one system call.
const READ_BYTES: usize = 64 << 10;
/// How much of an oversized line is handed back.
const HEAD_BYTES: usize = 1024;

/// Outcome of waiting for a line.
#[derive(Debug)]
pub enum ReadLine {
    /// A whole line.
    Line {
        /// Without the newline.
        bytes: Vec<u8>,
        /// When its last byte had been read.
        at: Instant,
    },
    /// More than the cap came without a newline. The stream is out of step: end the agent.
    TooLong {
        /// The first bytes of the line, at most 1 KiB.
        head: Vec<u8>,
    },
    /// The deadline passed; what has come of the line so far is kept.
    TimedOut,
    /// End of output; the exit status follows from `diagnose_end()`.
    Closed,
}

/// How writing ended.
#[derive(Debug)]
pub(crate) enum Written {
    /// The call that took the last of it began at this time.
    At(Instant),
    Closed,
    TimedOut,
}

/// Both ends that the service holds.
#[derive(Debug)]
pub(crate) struct LinePipe {
    input: Option<OwnedFd>,
    output: OwnedFd,
    /// What has been read and not yet been handed out, from `start` on.
    buffer: Vec<u8>,
    start: usize,
    /// `buffer[start..searched]` holds no newline.
    searched: usize,
    last_read_at: Instant,
}

impl LinePipe {
    pub(crate) fn new(input: OwnedFd, output: OwnedFd) -> io::Result<Self> {
        ioctl_fionbio(&input, true)?;
        ioctl_fionbio(&output, true)?;
        Ok(Self {
            input: Some(input),
            output,
            buffer: Vec::with_capacity(2 * READ_BYTES),
            start: 0,
            searched: 0,
            last_read_at: Instant::now(),
        })
    }

    pub(crate) fn close_input(&mut self) {
        self.input = None;
    }

    /// Writes all of `bytes` before `deadline`.
    pub(crate) fn write(&mut self, mut bytes: &[u8], deadline: Instant) -> io::Result<Written> {
        let Some(input) = &self.input else {
            return Ok(Written::Closed);
        };
        loop {
            // Before the call: on a shared CPU the agent may run, and even answer, before it returns.
            let at = Instant::now();
            match write(input, bytes) {
                Ok(count) if count == bytes.len() => return Ok(Written::At(at)),
                Ok(count) => bytes = &bytes[count..],
                Err(Errno::PIPE) => return Ok(Written::Closed),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => {
                    if !wait_for(input.as_fd(), PollFlags::OUT, deadline)? {
                        return Ok(Written::TimedOut);
                    }
                }
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// The next line of at most `max_bytes`, newline not counted.
    pub(crate) fn read_line(
        &mut self,
        max_bytes: usize,
        deadline: Instant,
    ) -> io::Result<ReadLine> {
        loop {
            if let Some(outcome) = self.take_line(max_bytes) {
                return Ok(outcome);
            }
            if !wait_for(self.output.as_fd(), PollFlags::IN, deadline)? {
                return Ok(ReadLine::TimedOut);
            }
            if !self.fill()? {
                return Ok(ReadLine::Closed);
            }
            // A dribbling agent always has something to read: the deadline holds all the same.
            if Instant::now() >= deadline && !self.holds_line() {
                return Ok(self.take_line(max_bytes).unwrap_or(ReadLine::TimedOut));
            }
        }
    }

    /// Is there unread output, in the buffer or in the pipe?
    pub(crate) fn has_pending_output(&self) -> io::Result<bool> {
        Ok(self.start < self.buffer.len() || ioctl_fionread(&self.output)? > 0)
    }

    /// The descriptor's identity, for finding who else holds the pipe.
    pub(crate) fn output(&self) -> BorrowedFd<'_> {
        self.output.as_fd()
    }

    /// Has a whole line been read that has not been handed out?
    pub(crate) fn holds_line(&self) -> bool {
        self.buffer[self.searched..].contains(&b'\n')
    }

    fn take_line(&mut self, max_bytes: usize) -> Option<ReadLine> {
        let newline = self.buffer[self.searched..]
            .iter()
            .position(|&byte| byte == b'\n');
        let end = newline.map_or(self.buffer.len(), |offset| self.searched + offset);
        if end - self.start > max_bytes {
            let head = self.buffer[self.start..end.min(self.start + HEAD_BYTES)].to_vec();
            self.skip_to(newline.map_or(end, |_| end + 1));
            return Some(ReadLine::TooLong { head });
        }
        if newline.is_none() {
            self.searched = end;
            return None;
        }
        let bytes = self.buffer[self.start..end].to_vec();
        self.skip_to(end + 1);
        Some(ReadLine::Line {
            bytes,
            at: self.last_read_at,
        })
    }

    fn skip_to(&mut self, start: usize) {
        self.start = start;
        if start == self.buffer.len() {
            self.buffer.clear();
            self.start = 0;
        }
        self.searched = self.start;
    }

    /// Reads what is there; false at the end of output.
    fn fill(&mut self) -> io::Result<bool> {
        if self.start > 0 {
            self.buffer.drain(..self.start);
            self.searched -= self.start;
            self.start = 0;
        }
        // Bounded: `take_line` refuses before more than the cap and one read have gathered.
        self.buffer.reserve(READ_BYTES);
        let result = read(&self.output, spare_capacity(&mut self.buffer));
        self.last_read_at = Instant::now();
        match result {
            Ok(count) => Ok(count > 0),
            Err(Errno::AGAIN | Errno::INTR) => Ok(true),
            Err(error) => Err(error.into()),
        }
    }
}

/// Waits until `fd` is ready (or hung up) or `deadline` has passed; an expired deadline still asks once.
pub(crate) fn wait_for(
    fd: BorrowedFd<'_>,
    flags: PollFlags,
    deadline: Instant,
) -> io::Result<bool> {
    wait_for_any(&mut [PollFd::from_borrowed_fd(fd, flags)], deadline)
}

/// [`wait_for`] for several descriptors at once.
pub(crate) fn wait_for_any(fds: &mut [PollFd<'_>], deadline: Instant) -> io::Result<bool> {
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        let timeout = Timespec {
            tv_sec: i64::try_from(left.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: i64::from(left.subsec_nanos()),
        };
        match poll(fds, Some(&timeout)) {
            Ok(0) => return Ok(false),
            Ok(_) => return Ok(true),
            Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
    }
}
