//! Lines to and from the agent: capped, deadline-bounded, answers stamped right after their last byte.
//! What the agent leaves no room for is kept, and follows while an answer is waited for: a write never
//! waits, so that no time passes unseen.

use memchr::memchr;
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::{Errno, ioctl_fionread},
    net::{RecvFlags, SendFlags, Shutdown, recv, send, shutdown},
};
use std::{
    io,
    os::fd::{AsFd, BorrowedFd, OwnedFd},
    time::Instant,
};

/// One read: nearly every answer, so that it costs one system call. A read goes on as long as an agent adds bytes one
/// by one, so it must not take many.
const READ_BYTES: usize = 16 << 10;
/// How much of an oversized line is handed back.
const HEAD_BYTES: usize = 1024;

/// Outcome of waiting for a line.
#[derive(Debug)]
pub enum ReadLine {
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

/// Nobody reads the other end any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Closed;

/// Both ends that the service holds.
#[derive(Debug)]
pub(crate) struct LineSocket {
    input: OwnedFd,
    /// The agent has been told that nothing more will come.
    is_shut: bool,
    /// What there was no room for yet.
    unsent: Vec<u8>,
    output: OwnedFd,
    /// What one read brings.
    chunk: Box<[u8]>,
    /// What has been read and not yet been handed out, from `start` on.
    buffer: Vec<u8>,
    start: usize,
    /// `buffer[start..searched]` holds no newline.
    searched: usize,
    last_read_at: Instant,
}

impl LineSocket {
    pub(crate) fn new(input: OwnedFd, output: OwnedFd) -> Self {
        Self {
            input,
            is_shut: false,
            unsent: Vec::new(),
            output,
            chunk: vec![0; READ_BYTES].into(),
            buffer: Vec::with_capacity(2 * READ_BYTES),
            start: 0,
            searched: 0,
            last_read_at: Instant::now(),
        }
    }

    /// Ends the agent's standard input. The socket itself stays until the agent is dead: to close one may be work.
    pub(crate) fn end_input(&mut self) {
        self.is_shut = true;
        self.unsent.clear();
        if let Err(error) = shutdown(&self.input, Shutdown::Write) {
            tracing::debug!(%error, "an agent's input is ended already");
        }
    }

    /// Writes what there is room for; the rest follows while an answer is waited for.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> io::Result<Result<(), Closed>> {
        if !self.unsent.is_empty() {
            self.unsent.extend_from_slice(bytes);
            return self.send_rest();
        }
        let sent = self.write(bytes)?;
        Ok(sent.map(|count| self.unsent.extend_from_slice(&bytes[count..])))
    }

    /// Has everything been taken by the socket?
    pub(crate) const fn is_all_sent(&self) -> bool {
        self.unsent.is_empty()
    }

    fn send_rest(&mut self) -> io::Result<Result<(), Closed>> {
        let sent = self.write(&self.unsent)?;
        Ok(sent.map(|count| drop(self.unsent.drain(..count))))
    }

    /// Writes until there is no room; returns the number of bytes that were taken.
    fn write(&self, bytes: &[u8]) -> io::Result<Result<usize, Closed>> {
        if self.is_shut {
            return Ok(Err(Closed));
        }
        let mut sent = 0;
        while sent < bytes.len() {
            match send(
                &self.input,
                &bytes[sent..],
                SendFlags::DONTWAIT | SendFlags::NOSIGNAL,
            ) {
                Ok(count) => sent += count,
                Err(Errno::AGAIN) => break,
                Err(Errno::INTR) => {}
                Err(Errno::PIPE | Errno::CONNRESET) => return Ok(Err(Closed)),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(Ok(sent))
    }

    /// The next line of at most `max_bytes`, newline not counted.
    pub(crate) fn read_line(
        &mut self,
        max_bytes: usize,
        deadline: Instant,
    ) -> io::Result<ReadLine> {
        // An agent on the CPU that asked it has often answered when that comes back: to look is cheaper than to
        // ask first whether there is something.
        let mut may_be_there = self.is_all_sent();
        loop {
            if let Some(outcome) = self.take_line(max_bytes) {
                return Ok(outcome);
            }
            let ready = if may_be_there {
                true
            } else if self.is_all_sent() {
                wait_for(self.output.as_fd(), PollFlags::IN, deadline)?
            } else {
                wait_for_any(&mut self.awaited(), deadline)?
            };
            may_be_there = false;
            if !ready {
                return Ok(ReadLine::TimedOut);
            }
            if !self.fill()? {
                return Ok(ReadLine::Closed);
            }
            // A line that was there before the rest is handed out before: it answers something else.
            if self.holds_line() {
                continue;
            }
            if !self.is_all_sent() && self.send_rest()? == Err(Closed) {
                return Ok(ReadLine::Closed);
            }
            // A dribbling agent always has something to read: the deadline holds all the same.
            if Instant::now() >= deadline {
                return Ok(self.take_line(max_bytes).unwrap_or(ReadLine::TimedOut));
            }
        }
    }

    /// Takes what comes until `until`, without sleeping: to be woken takes longer than many an answer.
    pub(crate) fn look_out(&mut self, until: Instant) -> io::Result<()> {
        while self.is_all_sent() && !self.holds_line() {
            // Also of an agent that writes without end no more is taken than comes until then.
            if !self.fill()? || self.last_read_at >= until {
                break;
            }
        }
        Ok(())
    }

    /// What there is to wait for: output, and room for what was not sent yet.
    pub(crate) fn awaited(&self) -> Vec<PollFd<'_>> {
        let room = (!self.is_all_sent()).then(|| PollFd::new(&self.input, PollFlags::OUT));
        std::iter::once(PollFd::new(&self.output, PollFlags::IN))
            .chain(room)
            .collect()
    }

    /// Is there unread output, in the buffer or in the socket?
    pub(crate) fn has_pending_output(&self) -> io::Result<bool> {
        Ok(self.start < self.buffer.len() || ioctl_fionread(&self.output)? > 0)
    }

    /// Has a whole line been read that has not been handed out?
    pub(crate) fn holds_line(&self) -> bool {
        memchr(b'\n', &self.buffer[self.searched..]).is_some()
    }

    fn take_line(&mut self, max_bytes: usize) -> Option<ReadLine> {
        let newline = memchr(b'\n', &self.buffer[self.searched..]);
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
        let result = recv(&self.output, &mut self.chunk[..], RecvFlags::DONTWAIT);
        self.last_read_at = Instant::now();
        match result {
            Ok((count, _)) => {
                // Bounded: `take_line` refuses before more than the cap and one read have gathered.
                self.buffer.extend_from_slice(&self.chunk[..count]);
                Ok(count > 0)
            }
            // It closed its end with something of ours unread.
            Err(Errno::CONNRESET) => Ok(false),
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::{io::Write as _, os::unix::net::UnixStream, thread, time::Duration};

    /// The service's ends, and the agent's output.
    fn line_socket() -> (LineSocket, UnixStream) {
        let (_agents_input, input) = UnixStream::pair().unwrap();
        let (output, agents_output) = UnixStream::pair().unwrap();
        (LineSocket::new(input.into(), output.into()), agents_output)
    }

    #[test]
    fn looking_out_ends_with_the_line_with_the_output_and_with_its_time() {
        let far = || Instant::now() + Duration::from_secs(3600);
        let (mut lines, mut agent) = line_socket();
        agent.write_all(b"here\n").unwrap();
        lines.look_out(far()).unwrap();
        let line = lines.read_line(100, Instant::now()).unwrap();
        assert!(matches!(line, ReadLine::Line { bytes, .. } if bytes == b"here"));
        lines.look_out(Instant::now()).unwrap();
        assert!(!lines.holds_line());
        drop(agent);
        lines.look_out(far()).unwrap();
        let end = lines.read_line(100, far()).unwrap();
        assert!(matches!(end, ReadLine::Closed));
    }

    #[test]
    fn looking_out_for_a_line_that_never_ends_ends() {
        let (mut lines, mut agent) = line_socket();
        let flood = thread::spawn(move || while agent.write_all(&[b'x'; 4096]).is_ok() {});
        for _ in 0..10 {
            lines
                .look_out(Instant::now() + Duration::from_micros(50))
                .unwrap();
        }
        let line = lines.read_line(100, Instant::now() + Duration::from_secs(3600));
        assert!(matches!(line.unwrap(), ReadLine::TooLong { .. }));
        drop(lines);
        flood.join().unwrap();
    }
}
