//! The refusal of a profile that a competition does not have.

use crate::{Profile, task_weights::listed};

/// A name that no profile (set of perturbations) of the competition has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown profile {name:?}: expected {expected}")]
pub struct UnknownProfile {
    name: String,
    /// The names of the competition's profiles, in words.
    expected: String,
}

impl UnknownProfile {
    /// `expected` are the profiles of the competition.
    #[must_use]
    pub fn new(name: &str, expected: impl IntoIterator<Item = Profile>) -> Self {
        Self {
            name: name.to_owned(),
            expected: listed(expected, "or"),
        }
    }
}
