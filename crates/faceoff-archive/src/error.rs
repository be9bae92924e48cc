//! Errors of reading and writing archives of a season.

use crate::format::FORMAT;
use std::io;

/// Why an archive cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// The archive is invalid; the text says what was expected and what was found.
    #[error("{0}")]
    Refused(String),
    /// A later version of Faceoff wrote the archive.
    #[error(
        "the archive has format {format} (made by {program:?}), and this program reads format {FORMAT} and older \
         ones: use the version of Faceoff that made it, or a later one"
    )]
    Newer {
        /// Format number of the archive.
        format: u64,
        /// Name and version of the program that wrote it, from the manifest.
        program: String,
    },
    /// The disk failed, or the receiver of the archive closed the connection.
    #[error(transparent)]
    Io(#[from] io::Error),
}
