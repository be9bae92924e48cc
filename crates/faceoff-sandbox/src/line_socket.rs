//! Lines to and from the agent. Lines have a maximum length, reads have deadlines, and an answer's time is taken right after its last
//! byte.
//!
//! A write never blocks, so that all waiting time is measured. Bytes that do not fit into the agent's input
//! buffer are kept and sent while the evaluator waits for the answer.

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

/// Size of one read. Nearly every answer fits, and costs one system call. A larger read could take long, since it
/// continues while an agent adds bytes one by one.
const READ_BYTES: usize = 16 << 10;
/// Returned part of a line that is too long.
const HEAD_BYTES: usize = 1024;

/// Outcome of waiting for a line.
#[derive(Debug)]
pub enum ReadLine {
    Line {
        /// Without the newline.
        bytes: Vec<u8>,
        /// Time at which its last byte had been read.
        received_at: Instant,
    },
    /// The line exceeds the maximum length. The caller must end the agent, since the rest of the line would be read as the next one.
    TooLong {
        /// The first bytes of the line, at most 1 KiB.
        head: Vec<u8>,
    },
    /// The deadline has passed; the received part of the line is kept.
    TimedOut,
    /// End of output; [`AgentProcess::diagnose_end`](crate::AgentProcess::diagnose_end) returns the reason.
    Closed,
}

/// The agent's end is closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Closed;

/// The evaluator's ends of the agent's input and output.
#[derive(Debug)]
pub(crate) struct LineSocket {
    input: OwnedFd,
    /// The agent's input has been shut down.
    is_input_ended: bool,
    /// Bytes that did not fit into the socket yet.
    unsent: Vec<u8>,
    output: OwnedFd,
    /// Buffer of one read.
    read_buffer: Box<[u8]>,
    /// From `start` on: bytes that have been read and not returned yet.
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
            is_input_ended: false,
            unsent: Vec::new(),
            output,
            read_buffer: vec![0; READ_BYTES].into(),
            buffer: Vec::with_capacity(2 * READ_BYTES),
            start: 0,
            searched: 0,
            last_read_at: Instant::now(),
        }
    }

    /// Ends the agent's standard input. The socket stays open until the agent is dead, because closing it may take
    /// long.
    pub(crate) fn end_input(&mut self) {
        self.is_input_ended = true;
        self.unsent.clear();
        if let Err(error) = shutdown(&self.input, Shutdown::Write) {
            tracing::debug!(%error, "an agent's input is ended already");
        }
    }

    /// Writes what fits without blocking; [`Self::read_line`] sends the rest.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> io::Result<Result<(), Closed>> {
        if !self.unsent.is_empty() {
            self.unsent.extend_from_slice(bytes);
            return self.send_rest();
        }
        let sent = self.write(bytes)?;
        Ok(sent.map(|count| self.unsent.extend_from_slice(&bytes[count..])))
    }

    /// Has the socket accepted all bytes?
    pub(crate) const fn is_all_sent(&self) -> bool {
        self.unsent.is_empty()
    }

    fn send_rest(&mut self) -> io::Result<Result<(), Closed>> {
        let sent = self.write(&self.unsent)?;
        Ok(sent.map(|count| drop(self.unsent.drain(..count))))
    }

    /// Writes until the socket is full; returns the number of written bytes.
    fn write(&self, bytes: &[u8]) -> io::Result<Result<usize, Closed>> {
        if self.is_input_ended {
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
        // An agent on the same CPU has often answered by the time the evaluator runs again. Then reading at once is
        // cheaper than polling first.
        let mut may_be_ready = self.is_all_sent();
        loop {
            if let Some(outcome) = self.take_line(max_bytes) {
                return Ok(outcome);
            }
            let is_ready = if may_be_ready {
                true
            } else if self.is_all_sent() {
                wait_for(self.output.as_fd(), PollFlags::IN, deadline)?
            } else {
                wait_for_any(&mut self.poll_fds(), deadline)?
            };
            may_be_ready = false;
            if !is_ready {
                return Ok(ReadLine::TimedOut);
            }
            if !self.fill()? {
                return Ok(ReadLine::Closed);
            }
            // Return a complete line before sending the rest of the question: the line cannot be the answer to it.
            if self.has_line() {
                continue;
            }
            if !self.is_all_sent() && self.send_rest()? == Err(Closed) {
                return Ok(ReadLine::Closed);
            }
            // An agent that writes byte by byte always has something to read; the deadline applies nevertheless.
            if Instant::now() >= deadline {
                return Ok(self.take_line(max_bytes).unwrap_or(ReadLine::TimedOut));
            }
        }
    }

    /// Busy-polls for output until `deadline`: waking up from sleep takes longer than many answers.
    pub(crate) fn spin_until(&mut self, deadline: Instant) -> io::Result<()> {
        while self.is_all_sent() && !self.has_line() {
            // The deadline also ends the loop if an agent writes without end.
            if !self.fill()? || self.last_read_at >= deadline {
                break;
            }
        }
        Ok(())
    }

    /// The events to wait for: output and, if bytes are unsent, space for them.
    pub(crate) fn poll_fds(&self) -> Vec<PollFd<'_>> {
        let writable = (!self.is_all_sent()).then(|| PollFd::new(&self.input, PollFlags::OUT));
        std::iter::once(PollFd::new(&self.output, PollFlags::IN))
            .chain(writable)
            .collect()
    }

    /// Is there unread output in the buffer or in the socket?
    pub(crate) fn has_pending_output(&self) -> io::Result<bool> {
        Ok(self.start < self.buffer.len() || ioctl_fionread(&self.output)? > 0)
    }

    /// Does the buffer contain a complete line?
    pub(crate) fn has_line(&self) -> bool {
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
            received_at: self.last_read_at,
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

    /// Reads the available bytes; `false` at the end of output.
    fn fill(&mut self) -> io::Result<bool> {
        if self.start > 0 {
            self.buffer.drain(..self.start);
            self.searched -= self.start;
            self.start = 0;
        }
        let result = recv(&self.output, &mut self.read_buffer[..], RecvFlags::DONTWAIT);
        self.last_read_at = Instant::now();
        match result {
            Ok((count, _)) => {
                // Bounded: `take_line` refuses a line before the buffer holds more than the cap and one read.
                self.buffer.extend_from_slice(&self.read_buffer[..count]);
                Ok(count > 0)
            }
            // The agent closed its end without reading all its input.
            Err(Errno::CONNRESET) => Ok(false),
            Err(Errno::AGAIN | Errno::INTR) => Ok(true),
            Err(error) => Err(error.into()),
        }
    }
}

/// Waits until `fd` is ready (or hung up) or `deadline` has passed; with an expired deadline it polls once.
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
        let time_left = deadline.saturating_duration_since(Instant::now());
        let timeout = Timespec {
            tv_sec: i64::try_from(time_left.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: i64::from(time_left.subsec_nanos()),
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

    /// The evaluator's ends, and the agent's end of its output.
    fn line_socket() -> (LineSocket, UnixStream) {
        let (_agents_input, input) = UnixStream::pair().unwrap();
        let (output, agents_output) = UnixStream::pair().unwrap();
        (LineSocket::new(input.into(), output.into()), agents_output)
    }

    #[test]
    fn spinning_ends_with_line_deadline_or_end_of_output() {
        let distant_deadline = || Instant::now() + Duration::from_secs(3600);
        let (mut lines, mut agent) = line_socket();
        agent.write_all(b"here\n").unwrap();
        lines.spin_until(distant_deadline()).unwrap();
        let line = lines.read_line(100, Instant::now()).unwrap();
        assert!(matches!(line, ReadLine::Line { bytes, .. } if bytes == b"here"));
        lines.spin_until(Instant::now()).unwrap();
        assert!(!lines.has_line());
        drop(agent);
        lines.spin_until(distant_deadline()).unwrap();
        let end = lines.read_line(100, distant_deadline()).unwrap();
        assert!(matches!(end, ReadLine::Closed));
    }

    #[test]
    fn spinning_on_an_endless_line_ends() {
        let (mut lines, mut agent) = line_socket();
        let flood = thread::spawn(move || while agent.write_all(&[b'x'; 4096]).is_ok() {});
        for _ in 0..10 {
            lines
                .spin_until(Instant::now() + Duration::from_micros(50))
                .unwrap();
        }
        let line = lines.read_line(100, Instant::now() + Duration::from_secs(3600));
        assert!(matches!(line.unwrap(), ReadLine::TooLong { .. }));
        drop(lines);
        flood.join().unwrap();
    }
}
