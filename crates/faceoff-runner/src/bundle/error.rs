//! The error of opening or unpacking a bundle.

use std::io;

/// Failure to open or unpack a bundle.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// The team's mistake: the archive or its `agent.toml` violates the protocol. The text names the entry and is shown
    /// to the team.
    #[error("{0}")]
    Invalid(String),
    /// A platform fault: disk I/O failed, or the unpacking took too long.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The caller cancelled the unpacking.
    #[error("cancelled")]
    Cancelled,
}

impl BundleError {
    /// Converts an error of reading an archive, outside of its entries. If the disk failed, the error has a system error
    /// number; otherwise the bytes are invalid. Errors of `fs_err` do not have the number, so readers use plain files.
    pub(super) fn from_archive_read_error(source: io::Error) -> Self {
        match source.raw_os_error() {
            Some(_) => Self::Io(io::Error::new(
                source.kind(),
                format!("reading the archive: {source}"),
            )),
            None => Self::Invalid(format!("the archive is damaged: {source}")),
        }
    }

    /// Converts an error of reading `entry` of an archive, as [`Self::from_archive_read_error`] does.
    pub(super) fn from_read_error(entry: &str) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| match source.raw_os_error() {
            None if !entry.is_empty() => {
                Self::Invalid(format!("the archive is damaged at {entry:?}: {source}"))
            }
            _ => Self::from_archive_read_error(source),
        }
    }
}
