//! The one way from commands to the terminal. Names, logs and lines of agents, and files from anywhere, are
//! shown with it, so nothing passes that steers a terminal, hides, or turns the writing direction.
//!
//! `print!`, `println!` and `eprintln!` are these in the whole program.

use faceoff_types::harmless;
use std::{
    fmt,
    io::{self, BufWriter, Stderr, StdoutLock, Write},
    sync::atomic::{AtomicBool, Ordering},
};

macro_rules! print {
    ($($text:tt)*) => { $crate::terminal::print(::std::format_args!($($text)*)) };
}

macro_rules! println {
    ($($text:tt)*) => { print!("{}\n", ::std::format_args!($($text)*)) };
}

macro_rules! eprintln {
    ($($text:tt)*) => { $crate::terminal::print_error(::std::format_args!($($text)*)) };
}

static NOBODY_READS: AtomicBool = AtomicBool::new(false);

/// Has whoever read standard output gone away? Then nothing that is told again and again has a reader.
pub fn nobody_reads() -> bool {
    NOBODY_READS.load(Ordering::Relaxed)
}

/// Where nobody reads on, as in `faceoff board | head`, the rest is said to nobody, and the command goes on to its own end.
pub fn print(text: fmt::Arguments<'_>) {
    if nobody_reads() {
        return;
    }
    let text = text.to_string();
    match write!(io::stdout(), "{}", harmless(&text)) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
            NOBODY_READS.store(true, Ordering::Relaxed);
        }
        Err(error) => {
            print_error(format_args!("error: writing to standard output: {error}\n"));
            std::process::exit(1)
        }
    }
}

#[expect(
    clippy::print_stderr,
    reason = "an error of a command meets the terminal"
)]
pub fn print_error(text: fmt::Arguments<'_>) {
    ::std::eprintln!("{}", harmless(&text.to_string()));
}

/// Standard output for a stream of lines; it ends with a flush.
pub fn stdout() -> Lines<BufWriter<StdoutLock<'static>>> {
    Lines::to(BufWriter::new(io::stdout().lock()))
}

/// Standard error, line by line.
pub fn stderr() -> Lines<Stderr> {
    Lines::to(io::stderr())
}

/// Passes on whole lines, harmless ones.
#[derive(Debug)]
pub struct Lines<W> {
    out: W,
    /// What came since the last line break.
    line: Vec<u8>,
}

impl<W: Write> Lines<W> {
    fn to(out: W) -> Self {
        Self {
            out,
            line: Vec::new(),
        }
    }

    fn pass_on(&mut self) -> io::Result<()> {
        let line = std::mem::take(&mut self.line);
        self.out
            .write_all(harmless(&String::from_utf8_lossy(&line)).as_bytes())
    }
}

impl<W: Write> Write for Lines<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.line.extend_from_slice(bytes);
        if bytes.contains(&b'\n') {
            let rest = match self.line.iter().rposition(|byte| *byte == b'\n') {
                Some(end) => self.line.split_off(end + 1),
                None => Vec::new(),
            };
            self.pass_on()?;
            self.line = rest;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.pass_on()?;
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_harmless_however_it_is_cut() {
        let text = "{\"team\":\"a\u{202e}b\"}\n\u{9b}2Jé";
        for size in 1..text.len() {
            let mut lines = Lines::to(Vec::new());
            for piece in text.as_bytes().chunks(size) {
                lines.write_all(piece).unwrap();
            }
            lines.flush().unwrap();
            assert_eq!(
                String::from_utf8(lines.out).unwrap(),
                "{\"team\":\"a\\u202eb\"}\n\\u009b2Jé"
            );
        }
    }
}
