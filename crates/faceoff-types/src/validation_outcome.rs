//! The outcome of a validation run: the short test of a new submission, which decides whether it may be evaluated.

use crate::{Task, ViolationName};
use serde::{Deserialize, Serialize};

/// The outcome of a validation run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum ValidationOutcome {
    /// The agent starts, answers, and does so in time.
    Valid {
        /// Runtime named in its manifest, `agent.toml`.
        runtime: String,
        /// Name of the agent in its manifest.
        agent_name: String,
        /// Answer times, one entry per task.
        timing: Vec<ValidationTiming>,
        /// The stored part of its standard error: its beginning and its end.
        log: String,
    },
    /// The bundle is faulty, or the agent fails or is too slow.
    Invalid {
        /// Runtime named in its manifest, if that could be read.
        runtime: Option<String>,
        /// Name of the agent in its manifest, if that could be read.
        agent_name: Option<String>,
        /// What is wrong, and where.
        reason: String,
        /// Answer times of the tasks that were played.
        timing: Vec<ValidationTiming>,
        /// The stored part of its standard error: its beginning and its end.
        log: String,
    },
}

/// Answer times of an agent in a validation run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ValidationTiming {
    /// The task.
    pub task: Task,
    /// Control steps that were answered.
    pub steps: u32,
    /// Mean computation time of a step, seconds.
    pub mean_s: f64,
    /// 99th percentile of the computation times, seconds.
    pub p99_s: f64,
    /// Longest computation time of a step, seconds.
    pub max_s: f64,
    /// Penalty points per episode for computation time.
    pub points_per_episode: f64,
    /// Episodes that were played, the last one perhaps in part; 0 in validation runs by earlier versions.
    #[serde(default)]
    pub episodes: u32,
    /// The violated limits of the robot, each with its number of episodes. They cost penalty points in evaluations.
    #[serde(default)]
    pub violations: Vec<ViolatedLimit>,
}

/// A limit of the robot that an agent violated in a validation run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ViolatedLimit {
    /// The limit.
    pub limit: ViolationName,
    /// Episodes in which it was violated.
    pub episodes: u32,
}
