//! Table of an evaluation's result by task. A *tier* is the class of an agent by its penalty points.

use faceoff_types::EvaluationResult;
use std::fmt::Write as _;

/// The result as text. The columns from `ee` to `time` count the violations of each constraint: end effector, links, joint
/// positions, joint velocities, computation time.
pub(super) fn result_table(agent: &str, result: &EvaluationResult) -> String {
    let mut out = String::new();
    let line = |out: &mut String, args: std::fmt::Arguments<'_>| {
        out.write_fmt(args).expect("writing to memory cannot fail");
        out.push('\n');
    };
    line(
        &mut out,
        format_args!(
            "{agent}: {} ({}), seed {}",
            result.profile, result.ruleset, result.seed
        ),
    );
    line(
        &mut out,
        format_args!(
            "\n{:<8} {:>8} {:>8} {:>17} {:>8}  {:<15} {:>4} {:>4} {:>4} {:>4} {:>4}  {:>23}",
            "task",
            "episodes",
            "success",
            "95 % interval",
            "penalty",
            "tier",
            "ee",
            "link",
            "pos",
            "vel",
            "time",
            "time mean/p99/max [ms]"
        ),
    );
    for (task, task_result) in &result.tasks {
        let [low, high] = task_result.success_ci95;
        let violations = task_result.violations;
        let time_s = task_result.computation_time_s;
        line(
            &mut out,
            format_args!(
                "{task:<8} {:>8} {:>6.1} % {:>17} {:>8.1}  {:<15} {:>4} {:>4} {:>4} {:>4} {:>4}  {:>23}",
                task_result.episodes,
                100.0 * task_result.success_rate,
                format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high),
                task_result.penalty_points,
                task_result.tier.title(),
                violations.ee,
                violations.link,
                violations.joint_pos,
                violations.joint_vel,
                violations.computation_time,
                format!(
                    "{:.2} / {:.2} / {:.2}",
                    1e3 * time_s.mean,
                    1e3 * time_s.p99,
                    1e3 * time_s.max
                ),
            ),
        );
    }
    line(
        &mut out,
        format_args!(
            "\nscore {:.1} %, penalty points {:.1}, tier: {}",
            result.score,
            result.penalty_points,
            result.tier.title()
        ),
    );
    out
}
