//! Helpers of the tests.

use faceoff_types::{
    ComputationTime, ComputationTimeSummary, EpisodeEnd, EpisodeOutcome, Task, TaskResult,
    TaskWeights, TeamName, TierBounds, ViolationCounts, Violations,
};
use serde_json::Value;

pub fn team(name: &str) -> TeamName {
    name.parse().unwrap()
}

/// Parses JSON like the command line, with paths in errors.
pub fn read<T: serde::de::DeserializeOwned>(json: &str) -> Result<T, String> {
    let mut json = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut json).map_err(|error| error.to_string())
}

/// The rows of a table in a golden file.
pub fn rows<'a>(golden: &'a Value, table: &str) -> &'a [Value] {
    golden[table].as_array().unwrap()
}

/// A failed episode without violations.
pub fn episode(task: Task, episode: u32) -> EpisodeOutcome {
    EpisodeOutcome {
        task,
        episode,
        steps: 500,
        end: EpisodeEnd::HORIZON,
        success: false,
        violations: Violations::default(),
        computation_time: ComputationTime {
            mean_s: 0.001,
            max_s: 0.002,
        },
        fault: None,
    }
}

/// The result of a task without violations, steps and times.
pub fn task_result(episodes: u32, successes: u32, penalty_points: f64) -> TaskResult {
    TaskResult {
        episodes,
        successes,
        success_rate: f64::from(successes) / f64::from(episodes),
        success_ci95: faceoff_scoring::wilson95(successes, episodes),
        penalty_points,
        violations: ViolationCounts::default(),
        tier: Some(faceoff_scoring::tier_of(penalty_points, episodes)),
        steps: 0,
        computation_time_s: ComputationTimeSummary::default(),
    }
}

/// The weights of the tasks in the ruleset.
pub fn weights() -> TaskWeights {
    faceoff_airhockey::competition().weights(&Default::default())
}

/// The bounds of the tiers in the ruleset.
pub fn bounds() -> Option<TierBounds> {
    faceoff_airhockey::competition().tiers
}
