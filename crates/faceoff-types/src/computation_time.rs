use serde::{Deserialize, Serialize};

/// Computation times of one episode's steps, in seconds: from the last byte of the `step` line
/// written to the last byte of the `act` line read.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ComputationTime {
    /// Mean over the episode's answered steps; 0 when there was none.
    pub mean_s: f64,
    /// Maximum over the episode's answered steps; 0 when there was none.
    pub max_s: f64,
}
