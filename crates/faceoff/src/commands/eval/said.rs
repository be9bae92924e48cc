use std::fmt;

/// Where words go beside the result.
#[derive(Debug, Clone, Copy)]
pub(super) enum Said {
    /// To standard output, with the result.
    Beside,
    /// To standard error: standard output has JSON alone.
    Apart,
}

impl Said {
    pub(super) fn line(self, words: fmt::Arguments<'_>) {
        match self {
            Self::Beside => println!("{words}"),
            Self::Apart => eprintln!("{words}"),
        }
    }
}
