//! Errors of writing a recording and of reading a dataset.

use faceoff_replay::ReplayError;
use faceoff_types::is_full_disk;
use std::{error::Error, fmt::Display, io};

/// Failure to write or join a recording; never an agent fault.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file could not be read or written; the error names it.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The disk is full; the text names the operation.
    #[error("the disk is full: {0}")]
    FullDisk(String),
    /// The recording is damaged, incomplete, or of another evaluation.
    #[error("{0}")]
    Unusable(String),
}

impl RecordingError {
    /// Wraps an error with the attempted operation.
    pub(crate) fn unusable<E: Error + 'static>(context: impl Display) -> impl FnOnce(E) -> Self {
        move |error| {
            let text = format!("{context}: {error}");
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

/// Reason why a dataset cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be read; the error names it.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The files are not a dataset, or not a complete one.
    #[error("not a readable dataset: {0}")]
    Unreadable(String),
    /// The dataset is of another layout, ruleset or simulator.
    #[error("{0}")]
    Foreign(String),
    /// The dataset's bytes differ from the published ones.
    #[error("damaged or altered: {0}")]
    Altered(String),
    /// The dataset does not contain the requested episode or column.
    #[error("{0}")]
    Absent(String),
}

impl DatasetError {
    /// Wraps an error with the file or value that was read.
    pub(crate) fn unreadable<E: Display>(context: impl Display) -> impl FnOnce(E) -> Self {
        move |error| Self::Unreadable(format!("{context}: {error}"))
    }
}
