//! A difference that verification found.

use faceoff_types::Task;
use serde::Serialize;
use std::fmt;

/// A recorded value that differs from the simulation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    pub file: &'static str,
    /// The task, if the difference is in one.
    pub task: Option<Task>,
    /// The episode, if the difference is in one.
    pub episode: Option<u32>,
    /// The rally of a game, if the difference is in one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rally: Option<u32>,
    /// The control step, if the difference is in one.
    pub step: Option<u32>,
    /// The column, or the path in a JSON file.
    pub field: String,
    pub recorded: String,
    /// The value of the simulation, or a description of the expected one.
    pub expected: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.file)?;
        if let Some(task) = self.task {
            write!(f, ", {task}")?;
        }
        if let Some(episode) = self.episode {
            write!(f, ", episode {episode}")?;
        }
        if let Some(rally) = self.rally {
            write!(f, ", rally {rally}")?;
        }
        if let Some(step) = self.step {
            write!(f, ", step {step}")?;
        }
        let Self {
            field,
            recorded,
            expected,
            ..
        } = self;
        write!(f, ", {field}: recorded {recorded}, expected {expected}")
    }
}
