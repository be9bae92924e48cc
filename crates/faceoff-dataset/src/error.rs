use faceoff_replay::ReplayError;
use faceoff_types::is_full_disk;
use std::{error::Error, fmt::Display, io};

/// A recording that could not be made or joined; never the agent's fault.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file could not be read or written; the error names it.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// There was no room for it; the text says for what.
    #[error("the disk is full: {0}")]
    FullDisk(String),
    /// What was recorded is damaged, incomplete, or belongs elsewhere.
    #[error("{0}")]
    Unusable(String),
}

impl RecordingError {
    /// What was attempted, and why it failed.
    pub(crate) fn unusable<E: Error + 'static>(what: impl Display) -> impl FnOnce(E) -> Self {
        move |error| {
            let text = format!("{what}: {error}");
            if is_full_disk(&error) {
                Self::FullDisk(text)
            } else {
                Self::Unusable(text)
            }
        }
    }
}

impl From<ReplayError> for RecordingError {
    fn from(error: ReplayError) -> Self {
        match error {
            ReplayError::Io(error) => Self::Io(error),
            unreadable @ ReplayError::Unreadable { .. } => Self::Unusable(unreadable.to_string()),
        }
    }
}

/// Why a dataset cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be read; the error names it.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no dataset, or not a whole one.
    #[error("not a readable dataset: {0}")]
    Unreadable(String),
    /// It is a dataset of another layout, ruleset or simulator.
    #[error("{0}")]
    Foreign(String),
    /// Its bytes are not those that were published.
    #[error("damaged or altered: {0}")]
    Altered(String),
    /// It holds no such episode.
    #[error("{0}")]
    Absent(String),
}

impl DatasetError {
    /// What was read, and why it makes no sense.
    pub(crate) fn unreadable<E: Display>(what: impl Display) -> impl FnOnce(E) -> Self {
        move |error| Self::Unreadable(format!("{what}: {error}"))
    }
}
