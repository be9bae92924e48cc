//! The tasks of the qualifying stage.

use faceoff_types::{Task, UnknownTask};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A task of the qualifying stage (paper on the 2023 Robot Air Hockey Challenge, §2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AirHockeyTask {
    /// Score a goal against an opponent that moves in a fixed pattern.
    Hit,
    /// Stop an incoming puck on the agent's own side.
    Defend,
    /// Move a puck from the border to a good hitting position.
    Prepare,
}

impl AirHockeyTask {
    /// All tasks, in the order of boards.
    pub const ALL: [Self; 3] = [Self::Hit, Self::Defend, Self::Prepare];

    /// Its name, by which others know it.
    #[must_use]
    pub const fn name(self) -> Task {
        match self {
            Self::Hit => Task::new("hit"),
            Self::Defend => Task::new("defend"),
            Self::Prepare => Task::new("prepare"),
        }
    }
}

impl fmt::Display for AirHockeyTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.name().fmt(f)
    }
}

impl From<AirHockeyTask> for Task {
    fn from(task: AirHockeyTask) -> Self {
        task.name()
    }
}

impl FromStr for AirHockeyTask {
    type Err = UnknownTask;
    fn from_str(name: &str) -> Result<Self, UnknownTask> {
        let found = Self::ALL
            .into_iter()
            .find(|task| task.name().as_str() == name);
        found.ok_or_else(|| UnknownTask::new(name, Self::ALL.map(Self::name)))
    }
}

impl TryFrom<Task> for AirHockeyTask {
    type Error = UnknownTask;
    fn try_from(name: Task) -> Result<Self, UnknownTask> {
        name.as_str().parse()
    }
}
