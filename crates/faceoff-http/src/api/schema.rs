//! Shapes of answers for the OpenAPI document where the type itself lives in a crate that knows
//! nothing of HTTP. A test holds them to the real types.
#![expect(
    dead_code,
    reason = "only their shape is used, by the OpenAPI document"
)]

use utoipa::ToSchema;

/// Problem details (RFC 9457).
#[derive(ToSchema)]
#[schema(as = Problem)]
pub(crate) struct ProblemBody {
    /// Kind of the problem, explained at that place of the server.
    #[schema(example = "/problems#already-evaluated")]
    r#type: String,
    /// The kind in a few words.
    title: String,
    /// The HTTP status.
    status: u16,
    /// What was expected, what came and what to do.
    detail: String,
}

/// Episodes in which each constraint was violated.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct ViolationCounts {
    /// End-effector position.
    ee: u32,
    /// Elbow and wrist height.
    link: u32,
    /// Joint position.
    joint_pos: u32,
    /// Joint velocity.
    joint_vel: u32,
    /// Computation time.
    computation_time: u32,
}

/// Computation times over all steps of a task, in seconds.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct ComputationTimeSummary {
    /// Mean.
    mean: f64,
    /// 99th percentile.
    p99: f64,
    /// Maximum.
    max: f64,
}

/// The score of one task.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct TaskResult {
    /// Episodes played.
    episodes: u32,
    /// Episodes that ended in success.
    successes: u32,
    /// Fraction of successes.
    success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    success_ci95: [f64; 2],
    /// Penalty points over all episodes.
    penalty_points: f64,
    /// Episodes with each violation.
    violations: ViolationCounts,
    /// deployable, improvable or non_deployable.
    tier: String,
    /// Control steps played.
    steps: u64,
    /// Computation times.
    computation_time_s: ComputationTimeSummary,
}

/// Two evaluations on the same episodes of one task.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct TaskComparison {
    /// Episodes that both solved.
    both: u32,
    /// Episodes that only A solved.
    only_a: u32,
    /// Episodes that only B solved.
    only_b: u32,
    /// Episodes that neither solved.
    neither: u32,
    /// A's success rate, a fraction.
    success_rate_a: f64,
    /// B's success rate, a fraction.
    success_rate_b: f64,
    /// Success rate of A minus that of B.
    difference: f64,
    /// Its 95 % interval for paired data (Newcombe's method 10).
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    difference_ci95: [f64; 2],
    /// McNemar's exact test, two-sided.
    p_value: f64,
    /// Is the p-value at most 0.05?
    told_apart: bool,
}

/// The overall scores of two evaluations on the same episodes.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct OverallComparison {
    /// A's score in percent.
    score_a: f64,
    /// B's score in percent.
    score_b: f64,
    /// Score of A minus that of B, in percentage points.
    difference: f64,
    /// Its 95 % interval: the tasks' intervals, weighed and joined by the square-and-add method.
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    difference_ci95: [f64; 2],
    /// The exact paired test of the weighted score, two-sided.
    p_value: f64,
    /// Is the p-value at most 0.05?
    told_apart: bool,
}

/// Round trips to an agent that answers at once, in seconds.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct RoundTrips {
    /// How many were measured.
    count: u32,
    /// Median.
    p50: f64,
    /// 99th percentile.
    p99: f64,
    /// Maximum.
    max: f64,
}

/// How evenly the slots kept time: the worst of them, value by value.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct SlotTiming {
    /// Before the first episode.
    before_s: RoundTrips,
    /// Between the episodes.
    during_s: RoundTrips,
    /// Longest time for which one of the slots' CPUs served nobody, in seconds.
    longest_stall_s: f64,
    /// Tries of episodes that were dropped and played again because the host stalled.
    host_noise_reruns: u32,
}

/// How an agent did in one task under one profile, beside the ideal one on the same episodes.
#[derive(ToSchema)]
#[cfg_attr(test, derive(serde::Deserialize), serde(deny_unknown_fields))]
pub(crate) struct ProfileEffect {
    /// The perturbations.
    profile: String,
    /// Episodes played.
    episodes: u32,
    /// Episodes that ended in success.
    successes: u32,
    /// Fraction of successes.
    success_rate: f64,
    /// 95 % Wilson interval of the success rate, as fractions.
    #[schema(value_type = Vec<f64>, min_items = 2, max_items = 2)]
    success_ci95: [f64; 2],
    /// Penalty points over all episodes.
    penalty_points: f64,
    /// The success rate less the ideal profile's, as a fraction.
    difference: f64,
    /// Episodes that succeed in the ideal profile only.
    lost: u32,
    /// Episodes that succeed in this profile only.
    gained: u32,
    /// McNemar's exact test against the ideal profile, two-sided.
    p_value: f64,
}

#[cfg(test)]
mod tests {
    use faceoff_scoring::{OverallComparison, TaskComparison};
    use faceoff_types::{
        ComputationTimeSummary, Profile, SlotTiming, TaskResult, Tier, ViolationCounts,
    };

    fn describes<Schema: serde::de::DeserializeOwned>(real: &impl serde::Serialize) {
        let json = serde_json::to_string(real).unwrap();
        serde_json::from_str::<Schema>(&json).unwrap();
    }

    #[test]
    fn the_document_describes_the_real_result() {
        describes::<super::TaskResult>(&TaskResult {
            episodes: 1,
            successes: 1,
            success_rate: 1.0,
            success_ci95: [0.2, 1.0],
            penalty_points: 0.5,
            violations: ViolationCounts::default(),
            tier: Tier::Deployable,
            steps: 3,
            computation_time_s: ComputationTimeSummary::default(),
        });
    }

    #[test]
    fn the_document_describes_the_real_timing() {
        describes::<super::SlotTiming>(&SlotTiming::default());
    }

    #[test]
    fn the_document_describes_the_real_comparison() {
        describes::<super::TaskComparison>(&TaskComparison {
            both: 1,
            only_a: 2,
            only_b: 3,
            neither: 4,
            success_rate_a: 0.3,
            success_rate_b: 0.4,
            difference: -0.1,
            difference_ci95: [-0.5, 0.3],
            p_value: 1.0,
            told_apart: false,
        });
        describes::<super::OverallComparison>(&OverallComparison {
            score_a: 12.0,
            score_b: 16.0,
            difference: -4.0,
            difference_ci95: [-20.0, 12.0],
            p_value: 1.0,
            told_apart: false,
        });
    }

    #[test]
    fn the_document_describes_a_profiles_real_effect() {
        describes::<super::ProfileEffect>(&faceoff_scoring::ProfileEffect {
            profile: Profile::Ideal,
            episodes: 1,
            successes: 1,
            success_rate: 1.0,
            success_ci95: [0.2, 1.0],
            penalty_points: 0.0,
            difference: 0.0,
            lost: 0,
            gained: 0,
            p_value: 1.0,
        });
    }
}
