//! The runtimes (environments that agents run in, such as a version of Python) that a stage accepts.

use crate::{
    error::StoreError,
    tables::{
        stages::{self, Stage, StagePhase},
        submissions::Submission,
    },
};
use faceoff_types::{RuntimeRefused, StageRuntimes};
use jiff::Timestamp;

impl Stage {
    /// The runtimes that the stage accepts; `None`: all that the server offers.
    #[must_use]
    pub fn runtimes(&self) -> Option<StageRuntimes> {
        Some(StageRuntimes {
            stage: self.name.clone(),
            runtimes: self.revision.rules.runtimes.clone()?,
        })
    }

    /// Checks whether the stage accepts a submission.
    ///
    /// # Errors
    /// [`RuntimeRefused`] if the stage does not accept its runtime, or the runtime is unknown.
    pub fn check_accepts(&self, submission: &Submission) -> Result<(), RuntimeRefused> {
        self.runtimes().map_or(Ok(()), |accepted| {
            accepted.check(submission.runtime.as_deref())
        })
    }
}

/// The runtimes of the stages of which at least one must accept an upload at `now`: the open stages, or the current one if
/// none is open. Empty if one of them accepts all runtimes.
pub(crate) fn required_runtimes(all: &[Stage], now: Timestamp) -> Vec<StageRuntimes> {
    let is_open = |stage: &&Stage| stage.phase(now) == StagePhase::Open;
    let mut stages: Vec<&Stage> = all.iter().filter(is_open).collect();
    if stages.is_empty() {
        stages.extend(stages::current(all, now));
    }
    let required: Option<_> = stages.into_iter().map(Stage::runtimes).collect();
    required.unwrap_or_default()
}

/// The error for a request with a submission whose runtime is not accepted.
pub(crate) fn conflict(refusal: &RuntimeRefused) -> StoreError {
    StoreError::Conflict(refusal.to_string())
}
