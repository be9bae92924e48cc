//! Which agents a stage takes, by their runtimes.

use crate::{
    error::StoreError,
    tables::{
        stages::{self, Stage, StagePhase},
        submissions::Submission,
    },
};
use faceoff_types::{RuntimeNotTaken, StageRuntimes};
use jiff::Timestamp;

impl Stage {
    /// The runtimes that it takes; `None`: all that the server offers.
    #[must_use]
    pub fn runtimes(&self) -> Option<StageRuntimes> {
        Some(StageRuntimes {
            stage: self.name.clone(),
            runtimes: self.rules.rules.runtimes.clone()?,
        })
    }

    /// Does it take an agent?
    ///
    /// # Errors
    /// If it does not take its runtime, or that is not known.
    pub fn check_takes(&self, submission: &Submission) -> Result<(), RuntimeNotTaken> {
        self.runtimes()
            .map_or(Ok(()), |taken| taken.check(submission.runtime.as_deref()))
    }
}

/// The stages one of which must take what is uploaded at `now`: those that are open, or the one that matters then.
/// None, if one of them takes any.
pub(crate) fn of_uploads(all: &[Stage], now: Timestamp) -> Vec<StageRuntimes> {
    let is_open = |stage: &&Stage| stage.phase(now) == StagePhase::Open;
    let mut stages: Vec<&Stage> = all.iter().filter(is_open).collect();
    if stages.is_empty() {
        stages.extend(stages::current(all, now));
    }
    let taken: Option<_> = stages.into_iter().map(Stage::runtimes).collect();
    taken.unwrap_or_default()
}

/// What is asked for by somebody, and cannot be.
pub(crate) fn conflict(why: &RuntimeNotTaken) -> StoreError {
    StoreError::Conflict(why.to_string())
}
