//! Errors of this crate.

/// A failure to read or write clips.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The data is invalid, too large, or from another version.
    #[error("{what} is not a clip that this version supports: {why}")]
    Unreadable {
        /// The file or clip.
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
