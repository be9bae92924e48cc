//! Notes: lines that are not part of a command's result.

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
    /// The stream that keeps the result of a command with or without `--json` readable.
    pub(super) const fn beside(json: bool) -> Self {
        if json { Self::Stderr } else { Self::Stdout }
    }

    pub(super) fn print(self, line: fmt::Arguments<'_>) {
        match self {
            Self::Stdout => println!("{line}"),
            Self::Stderr => eprintln!("{line}"),
        }
    }
}
