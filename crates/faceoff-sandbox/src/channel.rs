//! The channel between the *service* (the process that starts agents) and an agent: questions (lines to its standard input), answers
//! (lines from its standard output), and its log (standard error).
//!
//! Questions and answers pass through stream sockets, never pipes. A pipe has a single lock, held by the thread that is inside a call
//! on it. An agent can stay inside a call as long as it likes: in a `splice` from an empty socket, or in a `write`
//! of memory whose page fault waits for another of its threads. Reading, writing, closing, and even querying the
//! number of bytes would wait for that lock, even on a non-blocking pipe.
//!
//! The log is a pipe, so that programs can open `/dev/stderr`. Only the thread that reads it ([`crate::stderr_log`]) waits for its lock;
//! nothing else waits for that thread before the agent's processes have ended.
//!
//! Each end of a socket pair has its own lock, and no thread sleeps while it holds one. An agent can still make
//! the service's calls expensive: each read wakes all threads that poll the other end for space. Therefore reads
//! are small, and their time counts as the agent's time.
//!
//! Neither the agent nor a child of it can reopen an end of a socket by path through `/proc/*/fd`. The writer's buffer
//! determines the space for a question, so no agent can make it smaller.

use crate::{SandboxError, error::IoContext, fd_passing, line_socket::LineSocket};
use rustix::{
    fs::{Mode, fchmod, fstat},
    io::ioctl_fionbio,
    net::{
        AddressFamily, Shutdown, SocketFlags, SocketType, shutdown, socketpair,
        sockopt::{set_socket_send_buffer_size, socket_send_buffer_size},
    },
    pipe::{PipeFlags, fcntl_setpipe_size, pipe_with},
};
use std::{
    io,
    os::fd::{AsFd, OwnedFd},
};

/// Buffer size for questions: no question is longer, and an `end` followed by a `reset` fits as well.
const QUESTION_BUFFER_BYTES: usize = 64 << 10;
/// Buffer size for the unread part of the log.
const LOG_BUFFER_BYTES: usize = 16 << 10;

/// The service's ends and the agent's ends.
pub(crate) struct Channel {
    pub lines: LineSocket,
    pub log: OwnedFd,
    /// The agent's standard input, output and error.
    pub agent_fds: [OwnedFd; 3],
    /// How `/proc/*/fd` names the agent's end of its output.
    pub output_name: String,
}

impl Channel {
    pub(crate) fn new() -> Result<Self, SandboxError> {
        const ACTION: &str = "cannot make a channel to the agent";
        let (stdin, input) = socket_pair().context(ACTION)?;
        let (output, stdout) = socket_pair().context(ACTION)?;
        let (log, stderr) = log_pipe().context(ACTION)?;
        set_socket_send_buffer_size(&input, 2 * QUESTION_BUFFER_BYTES).context(ACTION)?;
        let size = socket_send_buffer_size(&input).context(ACTION)?;
        if size < QUESTION_BUFFER_BYTES {
            let reason =
                format!("the socket holds {size} bytes, {QUESTION_BUFFER_BYTES} are needed");
            return Err(SandboxError::other(ACTION, reason));
        }
        // Without this, bytes that an agent writes to its standard input would stay unread in the socket. The other
        // socket stays open in both directions: programs that poll their output for a hang-up would see one.
        shutdown(&input, Shutdown::Read).context(ACTION)?;
        fd_passing::disable(output.as_fd());
        let output_name = socket_name(&stdout).context(ACTION)?;
        Ok(Self {
            lines: LineSocket::new(input, output),
            log,
            agent_fds: [stdin, stdout, stderr],
            output_name,
        })
    }
}

fn socket_pair() -> io::Result<(OwnedFd, OwnedFd)> {
    Ok(socketpair(
        AddressFamily::UNIX,
        SocketType::STREAM,
        SocketFlags::CLOEXEC,
        None,
    )?)
}

/// The reading end, which never blocks for want of data, and the writing end.
fn log_pipe() -> io::Result<(OwnedFd, OwnedFd)> {
    let (reader, writer) = pipe_with(PipeFlags::CLOEXEC)?;
    ioctl_fionbio(&reader, true)?;
    fcntl_setpipe_size(&reader, LOG_BUFFER_BYTES)?;
    // The agent, which may be another user, can open it for writing.
    fchmod(&writer, Mode::WUSR | Mode::WGRP | Mode::WOTH)?;
    Ok((reader, writer))
}

/// The name of a socket in `/proc/*/fd`.
fn socket_name(socket: impl AsFd) -> io::Result<String> {
    Ok(format!("socket:[{}]", fstat(socket)?.st_ino))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadLine;
    use rustix::io::{Errno, read, write};
    use std::time::{Duration, Instant};

    #[test]
    fn long_question_is_sent_as_the_agent_reads() {
        let Channel {
            mut lines,
            agent_fds: [stdin, stdout, _],
            output_name,
            ..
        } = Channel::new().unwrap();
        assert!(output_name.starts_with("socket:["));
        let question: Vec<u8> = (0..16 * QUESTION_BUFFER_BYTES)
            .map(|i| b'a' + (i % 23) as u8)
            .collect();
        lines.send(&question).unwrap().unwrap();
        lines.send(b"\n").unwrap().unwrap();
        assert!(!lines.is_all_sent());
        let now = Instant::now();
        assert!(matches!(
            lines.read_line(10, now).unwrap(),
            ReadLine::TimedOut
        ));
        let mut received = Vec::new();
        while received.last() != Some(&b'\n') {
            let mut buffer = [0; 10_000];
            let count = read(&stdin, &mut buffer).unwrap();
            received.extend_from_slice(&buffer[..count]);
            let deadline = Instant::now();
            assert!(matches!(
                lines.read_line(10, deadline).unwrap(),
                ReadLine::TimedOut
            ));
        }
        assert!(lines.is_all_sent());
        assert_eq!(received[..question.len()], question);
        write(&stdout, b"yes\n").unwrap();
        let deadline = Instant::now() + Duration::from_secs(600);
        assert!(
            matches!(lines.read_line(10, deadline).unwrap(), ReadLine::Line { bytes, .. } if bytes == b"yes")
        );
        // The agent's end closes with unread bytes.
        lines.send(b"lost").unwrap().unwrap();
        drop(stdin);
        assert!(lines.send(b"gone").unwrap().is_err());
    }

    #[test]
    fn standard_input_cannot_be_written_to() {
        let Channel { agent_fds, .. } = Channel::new().unwrap();
        // Rust programs ignore the signal SIGPIPE, which the kernel sends as well.
        assert_eq!(write(&agent_fds[0], b"x"), Err(Errno::PIPE));
    }
}
