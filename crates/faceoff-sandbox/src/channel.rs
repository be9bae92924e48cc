//! What passes between service and agent: questions, answers, and the agent's log.
//!
//! All three are stream sockets, never pipes. A pipe has one lock, which is held by whoever is inside a call on
//! it, and an agent can stay inside for as long as it likes: in a `splice` from an empty socket, or in a `write`
//! of memory whose page fault waits for another of its threads. Reading, writing, closing, and even asking how
//! much there is, would wait for that lock, whether the pipe blocks or not. The two ends of a pair of sockets
//! have a lock each, under which nobody sleeps. What one end does can still be made dear for the other (each piece that is
//! read wakes all who poll for room), which is why no read takes much, and all of it is on the agent's time.
//!
//! Neither end can be opened by name through `/proc/*/fd`, by itself or a child, and the room for a question is
//! the writer's to decide, so that no agent can make it smaller.

use crate::{SandboxError, error::IoContext, line_socket::LineSocket, passed_files};
use rustix::{
    fs::fstat,
    net::{
        AddressFamily, Shutdown, SocketFlags, SocketType, shutdown, socketpair,
        sockopt::{set_socket_send_buffer_size, socket_send_buffer_size},
    },
};
use std::{
    io,
    os::fd::{AsFd, OwnedFd},
};

/// Room for questions: none is longer, and `end` with the `reset` after it fits as well.
const ROOM_BYTES: usize = 64 << 10;
/// Room for a log that nobody has read yet: what lies there is read at one go, byte by byte if need be.
const LOG_BYTES: usize = 16 << 10;

/// Our ends and the agent's.
pub(crate) struct Channel {
    pub lines: LineSocket,
    pub log: OwnedFd,
    /// The agent's standard input, output and error.
    pub agents: [OwnedFd; 3],
    /// How `/proc/*/fd` names the agent's end of its output.
    pub output_name: String,
}

impl Channel {
    pub(crate) fn new() -> Result<Self, SandboxError> {
        const WHAT: &str = "cannot make a channel to the agent";
        let (stdin, input) = sockets().context(WHAT)?;
        let (output, stdout) = sockets().context(WHAT)?;
        let (log, stderr) = sockets().context(WHAT)?;
        set_socket_send_buffer_size(&input, 2 * ROOM_BYTES).context(WHAT)?;
        let room = socket_send_buffer_size(&input).context(WHAT)?;
        if room < ROOM_BYTES {
            let why = format!("it holds {room} bytes, {ROOM_BYTES} are needed");
            return Err(SandboxError::other(WHAT, why));
        }
        set_socket_send_buffer_size(&stderr, LOG_BYTES).context(WHAT)?;
        // What an agent writes to its standard input would lie there unread. (The other two ways stay open in
        // both directions: programs that watch their output for a hang-up would see one.)
        shutdown(&input, Shutdown::Read).context(WHAT)?;
        for ours in [&output, &log] {
            passed_files::refuse(ours.as_fd());
        }
        let output_name = name(&stdout).context(WHAT)?;
        Ok(Self {
            lines: LineSocket::new(input, output),
            log,
            agents: [stdin, stdout, stderr],
            output_name,
        })
    }
}

fn sockets() -> io::Result<(OwnedFd, OwnedFd)> {
    Ok(socketpair(
        AddressFamily::UNIX,
        SocketType::STREAM,
        SocketFlags::CLOEXEC,
        None,
    )?)
}

fn name(end: impl AsFd) -> io::Result<String> {
    Ok(format!("socket:[{}]", fstat(end)?.st_ino))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadLine;
    use rustix::io::{Errno, read, write};
    use std::time::{Duration, Instant};

    #[test]
    fn a_long_question_follows_as_it_is_read() {
        let Channel {
            mut lines,
            agents: [stdin, stdout, _],
            output_name,
            ..
        } = Channel::new().unwrap();
        assert!(output_name.starts_with("socket:["));
        let question: Vec<u8> = (0..16 * ROOM_BYTES)
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
        let mut came = Vec::new();
        while came.last() != Some(&b'\n') {
            let mut some = [0; 10_000];
            let count = read(&stdin, &mut some).unwrap();
            came.extend_from_slice(&some[..count]);
            let until = Instant::now();
            assert!(matches!(
                lines.read_line(10, until).unwrap(),
                ReadLine::TimedOut
            ));
        }
        assert!(lines.is_all_sent());
        assert_eq!(came[..question.len()], question);
        write(&stdout, b"yes\n").unwrap();
        let until = Instant::now() + Duration::from_secs(600);
        assert!(
            matches!(lines.read_line(10, until).unwrap(), ReadLine::Line { bytes, .. } if bytes == b"yes")
        );
        // Nobody reads any more, with something unread.
        lines.send(b"lost").unwrap().unwrap();
        drop(stdin);
        assert!(lines.send(b"gone").unwrap().is_err());
    }

    #[test]
    fn standard_input_cannot_be_written_to() {
        let Channel { agents, .. } = Channel::new().unwrap();
        // Rust's programs ignore the signal that comes with it.
        assert_eq!(write(&agents[0], b"x"), Err(Errno::PIPE));
    }
}
