//! The refusal of a task that a competition does not have.

use crate::{Task, task_weights::listed};

/// A name that no task of the competition has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown task {name:?}: expected {expected}")]
pub struct UnknownTask {
    name: String,
    /// The names of the competition's tasks, in words.
    expected: String,
}

impl UnknownTask {
    /// `expected` are the tasks of the competition.
    #[must_use]
    pub fn new(name: &str, expected: impl IntoIterator<Item = Task>) -> Self {
        Self {
            name: name.to_owned(),
            expected: listed(expected, "or"),
        }
    }
}
