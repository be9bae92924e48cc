use crate::format::FORMAT;
use std::io;

/// Why an archive was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// It is not what it should be; the text says what was expected and what came.
    #[error("{0}")]
    Refused(String),
    /// A later version of Faceoff made it.
    #[error(
        "the archive is of format {format} (made by {program:?}), and this program reads format {FORMAT} and older \
         ones: use the version of Faceoff that made it, or a later one"
    )]
    Newer {
        format: u64,
        /// What its manifest says of the program that made it.
        program: String,
    },
    /// The disk failed us, or whoever the archive was written to went away.
    #[error(transparent)]
    Io(#[from] io::Error),
}
