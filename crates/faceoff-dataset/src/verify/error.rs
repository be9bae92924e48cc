//! Errors of a verification.

use super::difference::Difference;
use crate::error::{DatasetError, RecordingError};

/// Reason why a dataset is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The dataset cannot be read, or this version cannot simulate it.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The recording of a shard is damaged, incomplete, or of another layout or simulator.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The first difference from the simulation.
    #[error("{0}")]
    Differs(Box<Difference>),
    /// This program does not know the ruleset, the profile or the perturbations of the job.
    #[error("the job cannot be simulated: {0}")]
    Job(String),
    /// The threads could not be started.
    #[error("starting the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl From<Difference> for VerifyError {
    fn from(difference: Difference) -> Self {
        Self::Differs(Box::new(difference))
    }
}
