use crate::Task;
use serde::{Deserialize, Serialize};

/// What a smoke run found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum SmokeOutcome {
    /// The agent starts, answers and keeps time.
    Valid {
        /// As its manifest names it.
        runtime: String,
        /// The name in its manifest.
        agent_name: String,
        /// How long its answers took, for each task in turn.
        timing: Vec<SmokeTiming>,
        /// Tail of its standard error.
        log: String,
    },
    Invalid {
        /// As its manifest names it, if that could be read.
        runtime: Option<String>,
        /// The name in its manifest, if that could be read.
        agent_name: Option<String>,
        /// What is wrong and where.
        reason: String,
        /// How long its answers took, as far as it came.
        timing: Vec<SmokeTiming>,
        /// Tail of its standard error.
        log: String,
    },
}

/// How long an agent's answers took in a smoke run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SmokeTiming {
    /// What was played.
    pub task: Task,
    /// Control steps that were answered.
    pub steps: u32,
    /// Mean computation time of a step, seconds.
    pub mean_s: f64,
    /// 99 of 100 steps took no longer, seconds.
    pub p99_s: f64,
    /// The longest step, seconds.
    pub max_s: f64,
    /// Penalty points for computation time, per episode.
    pub points_per_episode: f64,
}
