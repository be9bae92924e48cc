use faceoff_types::Task;
use serde::Serialize;
use std::fmt;

/// A recorded value that is not what the simulation gives.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    pub file: &'static str,
    /// The task, where it is about one.
    pub task: Option<Task>,
    /// The episode, where it is about one.
    pub episode: Option<u32>,
    /// The rally of a game, where it is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rally: Option<u32>,
    /// The control step, where it is about one.
    pub step: Option<u32>,
    /// The column, or the place in a JSON file.
    pub field: String,
    pub recorded: String,
    /// What it should be.
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
