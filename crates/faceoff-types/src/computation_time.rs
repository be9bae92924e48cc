//! Computation times: how long an agent takes to answer the steps of an episode.

use serde::{Deserialize, Serialize};

/// Computation times of one episode's steps, in seconds: from the last byte of the evaluator's
/// `step` line to the last byte of the agent's `act` line.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ComputationTime {
    /// Mean over the episode's answered steps; 0 when there was none.
    pub mean_s: f64,
    /// Maximum over the episode's answered steps; 0 when there was none.
    pub max_s: f64,
}
