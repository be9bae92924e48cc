use std::io;

/// Why a bundle cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// The team's: the archive or its `agent.toml` is not as the protocol wants it. The text names
    /// the entry and is shown to the team.
    #[error("{0}")]
    Invalid(String),
    /// Ours: the disk did not do what it should, or all of it took too long.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Nobody wants to know any more.
    #[error("cancelled")]
    Cancelled,
}

impl BundleError {
    /// Reading an archive fails either because the disk does, and then the error carries the
    /// system's number, or because the bytes make no sense. An error that names its path, as those of
    /// `fs_err` do, has lost the number: read from the bare file.
    pub(super) fn reading(entry: &str) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| match source.raw_os_error() {
            Some(_) => Self::Io(io::Error::new(
                source.kind(),
                format!("reading the archive: {source}"),
            )),
            None if entry.is_empty() => Self::Invalid(format!("the archive is damaged: {source}")),
            None => Self::Invalid(format!("the archive is damaged at {entry:?}: {source}")),
        }
    }
}
