use super::difference::Difference;
use crate::error::{DatasetError, RecordingError};

/// Why a dataset is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// It cannot be read, or not simulated by this version.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The recording of a shard is damaged, incomplete, or of another layout or simulator.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The first number that is not what the simulation gives.
    #[error("{0}")]
    Differs(Box<Difference>),
    /// The threads could not be started.
    #[error("starting the workers: {0}")]
    Workers(#[from] rayon::ThreadPoolBuildError),
}

impl From<Difference> for VerifyError {
    fn from(difference: Difference) -> Self {
        Self::Differs(Box::new(difference))
    }
}
