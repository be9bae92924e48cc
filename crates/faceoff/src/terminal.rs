//! All output of commands to the terminal. Names, logs and files may come from others, so control characters,
//! invisible characters and changes of the writing direction are escaped.
//!
//! The macros `print!`, `println!` and `eprintln!` replace the standard ones in the whole program.

use faceoff_types::escape_unprintable;
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

static STDOUT_CLOSED: AtomicBool = AtomicBool::new(false);

/// The reader of standard output has closed the pipe, so commands with endless output may stop.
pub fn stdout_is_closed() -> bool {
    STDOUT_CLOSED.load(Ordering::Relaxed)
}

/// Prints to standard output. If its reader has closed the pipe, as in `faceoff board | head`, further output is
/// dropped and the command continues.
pub fn print(text: fmt::Arguments<'_>) {
    if stdout_is_closed() {
        return;
    }
    let text = text.to_string();
    match write!(io::stdout(), "{}", escape_unprintable(&text)) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => {
            STDOUT_CLOSED.store(true, Ordering::Relaxed);
        }
        Err(error) => {
            print_error(format_args!("error: writing to standard output: {error}\n"));
            std::process::exit(1)
        }
    }
}

#[expect(
    clippy::print_stderr,
    reason = "this is the only place that writes errors to the terminal"
)]
pub fn print_error(text: fmt::Arguments<'_>) {
    ::std::eprintln!("{}", escape_unprintable(&text.to_string()));
}

/// Standard output for a stream of lines; it has to be flushed at the end.
pub fn stdout() -> Lines<BufWriter<StdoutLock<'static>>> {
    Lines::new(BufWriter::new(io::stdout().lock()))
}

/// Standard error, written line by line.
pub fn stderr() -> Lines<Stderr> {
    Lines::new(io::stderr())
}

/// Buffers what is written, and passes on whole lines with unprintable characters escaped.
#[derive(Debug)]
pub struct Lines<W> {
    out: W,
    /// Bytes since the last line break.
    line: Vec<u8>,
}

impl<W: Write> Lines<W> {
    fn new(out: W) -> Self {
        Self {
            out,
            line: Vec::new(),
        }
    }

    fn write_line(&mut self) -> io::Result<()> {
        let line = std::mem::take(&mut self.line);
        self.out
            .write_all(escape_unprintable(&String::from_utf8_lossy(&line)).as_bytes())
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
            self.write_line()?;
            self.line = rest;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.write_line()?;
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stream_is_escaped_for_any_piece_size() {
        let text = "{\"team\":\"a\u{202e}b\"}\n\u{9b}2Jé";
        for size in 1..text.len() {
            let mut lines = Lines::new(Vec::new());
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
