//! The two ways between service and agent, so made that an agent can neither shrink one nor get at an end
//! that was not given to it.
//!
//! A pipe can be opened anew through `/proc/*/fd`, by whoever its mode admits: its maker. A root service is
//! another user than its agents, so pipes, which are quicker, do; their size the seccomp filter keeps. An
//! ordinary user's agents are that user, who could also change the mode back: they get sockets, which
//! cannot be opened by name at all, and whose room the writer's end alone decides.

use crate::{SandboxError, error::IoContext, line_pipe::LinePipe};
use rustix::{
    fs::{FileType, fstat},
    net::{
        AddressFamily, SocketFlags, SocketType, socketpair,
        sockopt::{set_socket_send_buffer_size, socket_send_buffer_size},
    },
    pipe::{PipeFlags, fcntl_setpipe_size, pipe_with},
};
use std::{
    io,
    os::fd::{AsFd, OwnedFd},
};

/// Room for questions: none is longer, and `end` with the `reset` after it fits as well.
const ROOM_BYTES: usize = 64 << 10;

/// Which kind an agent gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Pipes,
    Sockets,
}

/// Both ways, our ends and the agent's.
pub(crate) struct Channel {
    pub lines: LinePipe,
    /// The agent's standard input and output.
    pub agents: [OwnedFd; 2],
    /// How `/proc/*/fd` names the agent's end of its output.
    pub output_name: String,
}

impl Channel {
    pub(crate) fn new(kind: Kind) -> Result<Self, SandboxError> {
        const WHAT: &str = "cannot make a channel to the agent";
        let [(stdin, input), (output, stdout)] = match kind {
            Kind::Pipes => [pipe().context(WHAT)?, pipe().context(WHAT)?],
            Kind::Sockets => [sockets().context(WHAT)?, sockets().context(WHAT)?],
        };
        let room = match kind {
            // Fails where the user has too many pipes: a small one would be unfair.
            Kind::Pipes => fcntl_setpipe_size(&input, ROOM_BYTES).context(WHAT)?,
            Kind::Sockets => {
                set_socket_send_buffer_size(&input, 2 * ROOM_BYTES).context(WHAT)?;
                socket_send_buffer_size(&input).context(WHAT)?
            }
        };
        if room < ROOM_BYTES {
            let why = format!("it holds {room} bytes, {ROOM_BYTES} are needed");
            return Err(SandboxError::other(WHAT, why));
        }
        let output_name = name(&stdout).context(WHAT)?;
        Ok(Self {
            lines: LinePipe::new(input, output).context(WHAT)?,
            agents: [stdin, stdout],
            output_name,
        })
    }
}

/// Reading end and writing end.
fn pipe() -> io::Result<(OwnedFd, OwnedFd)> {
    Ok(pipe_with(PipeFlags::CLOEXEC)?)
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
    let stat = fstat(end)?;
    let kind = match FileType::from_raw_mode(stat.st_mode) {
        FileType::Socket => "socket",
        _ => "pipe",
    };
    Ok(format!("{kind}:[{}]", stat.st_ino))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadLine;
    use rustix::io::{read, write};
    use std::time::{Duration, Instant};

    #[test]
    fn what_does_not_fit_follows_as_it_is_read_and_no_write_waits() {
        for kind in [Kind::Pipes, Kind::Sockets] {
            let Channel {
                mut lines,
                agents: [stdin, stdout],
                output_name,
            } = Channel::new(kind).unwrap();
            assert_eq!(output_name.starts_with("pipe:["), kind == Kind::Pipes);
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
    }
}
