//! Notes of `faceoff eval`: lines that are not part of its result.

use std::fmt;

/// The stream that notes are printed to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Notes {
    /// Together with the result.
    Stdout,
    /// Apart from the JSON on standard output.
    Stderr,
}

impl Notes {
    pub(super) fn print(self, line: fmt::Arguments<'_>) {
        match self {
            Self::Stdout => println!("{line}"),
            Self::Stderr => eprintln!("{line}"),
        }
    }
}
