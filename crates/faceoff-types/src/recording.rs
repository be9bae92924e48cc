//! The columns of a competition's recordings, beside those that all recordings have (task, episode, step, action, times).

use crate::ViolationName;

/// What is recorded of each control step, and of each episode's start.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordingColumns {
    /// The numbers of an observation, in their order. The prefix `obs_` is added, in tables of episodes `last_obs_`.
    pub observation: Vec<RecordingColumn>,
    /// The true state after a step; in tables of episodes, with the prefix `initial_`, the state before the first.
    pub state: Vec<RecordingColumn>,
    /// How far each limit is exceeded after a step: violated if above 0. The prefix `constraint_` is added. Every kind of violation of the
    /// competition once, but for the computation time.
    pub limits: Vec<ViolationName>,
}

/// A column of numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingColumn {
    pub name: String,
    /// Is it absent in some tasks? An observation without it is shorter, so only the last columns of an observation can be optional.
    pub optional: bool,
}

impl RecordingColumn {
    /// A column that all tasks have.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            optional: false,
        }
    }

    /// A column that some tasks do not have.
    pub fn optional(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            optional: true,
        }
    }
}
