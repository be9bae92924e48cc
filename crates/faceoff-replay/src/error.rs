//! Errors of this crate.

/// Clips that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The bytes are not what this version reads.
    #[error("{what} is no clip that this version reads: {why}")]
    Unreadable {
        /// Which file or clip.
        what: String,
        /// What is wrong with it.
        why: String,
    },
}

impl ReplayError {
    pub(crate) fn unreadable(what: impl Into<String>, why: impl ToString) -> Self {
        Self::Unreadable {
            what: what.into(),
            why: why.to_string(),
        }
    }
}
