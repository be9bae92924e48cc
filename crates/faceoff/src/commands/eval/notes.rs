use std::fmt;

/// Stream of notes that are not part of the result.
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
