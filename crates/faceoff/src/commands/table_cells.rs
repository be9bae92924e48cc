//! Cells that several tables have.

use faceoff_types::{ComputationTimeSummary, ViolationCounts};

/// Headings of the columns of [`violations`].
pub(super) const VIOLATIONS: &str = "  ee link  pos  vel time";

/// The violations of each constraint: end effector, links, joint positions, joint velocities, computation time.
pub(super) fn violations(counts: ViolationCounts) -> String {
    format!(
        "{:>4} {:>4} {:>4} {:>4} {:>4}",
        counts.ee, counts.link, counts.joint_pos, counts.joint_vel, counts.computation_time
    )
}

/// An interval of rates between 0 and 1, in percent.
pub(super) fn percent_interval(rates: [f64; 2]) -> String {
    let [low, high] = rates.map(|rate| 100.0 * rate);
    format!("{low:.1} to {high:.1} %")
}

/// Mean, 99th percentile and maximum of computation times, in milliseconds.
pub(super) fn milliseconds(time_s: ComputationTimeSummary) -> String {
    let [mean, p99, max] = [time_s.mean, time_s.p99, time_s.max].map(|seconds| 1e3 * seconds);
    format!("{mean:.2} / {p99:.2} / {max:.2}")
}
