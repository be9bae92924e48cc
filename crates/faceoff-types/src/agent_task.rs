//! The task that an agent is given: a task of the competition, or one side of a game against another agent.

use crate::Task;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The task of an agent: episodes of a task, or one side of a game. Its JSON is `{"task":"hit"}` or
/// `{"task":"tournament","side":2}`, for use with `#[serde(flatten)]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "AgentTaskFields", into = "AgentTaskFields")]
pub enum AgentTask {
    /// Episodes of a task of the competition, which one agent plays alone.
    Episodes(Task),
    /// A game against another agent.
    Game {
        /// The side that the agent plays.
        side: Side,
    },
}

impl AgentTask {
    /// The name that games have in place of a task's name, in the protocol and in files. No competition has a task of this name.
    pub const GAME: Task = Task::new("tournament");

    /// The name in the protocol: that of the task, or [`Self::GAME`].
    #[must_use]
    pub const fn name(self) -> Task {
        match self {
            Self::Episodes(task) => task,
            Self::Game { .. } => Self::GAME,
        }
    }

    /// `agent_id` of the protocol: 1, or 2 for the second side of a game.
    #[must_use]
    pub const fn agent_id(self) -> u32 {
        match self {
            Self::Episodes(_) => 1,
            Self::Game { side } => side.number(),
        }
    }
}

impl From<Task> for AgentTask {
    fn from(task: Task) -> Self {
        Self::Episodes(task)
    }
}

impl fmt::Display for AgentTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Episodes(task) => task.fmt(f),
            Self::Game { side } => write!(f, "tournament, side {}", side.number()),
        }
    }
}

/// A side of a game. Its JSON is its number, 1 or 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub enum Side {
    /// The simulator's first robot.
    First,
    /// The simulator's second robot.
    Second,
}

impl Side {
    /// Both sides, in the order of all arrays with one item per side.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }

    /// The number in the protocol: 1 or 2.
    #[must_use]
    pub const fn number(self) -> u32 {
        match self {
            Self::First => 1,
            Self::Second => 2,
        }
    }

    /// Index in an array with one item per side: 0 or 1.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
        }
    }
}

impl From<Side> for u32 {
    fn from(side: Side) -> Self {
        side.number()
    }
}

impl TryFrom<u32> for Side {
    type Error = String;
    fn try_from(number: u32) -> Result<Self, String> {
        match number {
            1 => Ok(Self::First),
            2 => Ok(Self::Second),
            other => Err(format!("a game has the sides 1 and 2, not {other}")),
        }
    }
}

/// The JSON form of [`AgentTask`].
#[derive(Serialize, Deserialize)]
struct AgentTaskFields {
    task: Task,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    side: Option<Side>,
}

impl From<AgentTask> for AgentTaskFields {
    fn from(agent_task: AgentTask) -> Self {
        let side = match agent_task {
            AgentTask::Episodes(_) => None,
            AgentTask::Game { side } => Some(side),
        };
        Self {
            task: agent_task.name(),
            side,
        }
    }
}

impl TryFrom<AgentTaskFields> for AgentTask {
    type Error = &'static str;
    fn try_from(AgentTaskFields { task, side }: AgentTaskFields) -> Result<Self, Self::Error> {
        match (task == Self::GAME, side) {
            (false, None) => Ok(Self::Episodes(task)),
            (true, Some(side)) => Ok(Self::Game { side }),
            (true, None) => Err("a tournament needs a side, 1 or 2"),
            (false, Some(_)) => Err("only a tournament has sides"),
        }
    }
}
