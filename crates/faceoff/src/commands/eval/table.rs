use faceoff_types::EvaluationResult;
use std::fmt::Write as _;

/// The result as text.
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
    for (task, r) in &result.tasks {
        let [low, high] = r.success_ci95;
        let v = r.violations;
        let t = r.computation_time_s;
        line(
            &mut out,
            format_args!(
                "{task:<8} {:>8} {:>6.1} % {:>17} {:>8.1}  {:<15} {:>4} {:>4} {:>4} {:>4} {:>4}  {:>23}",
                r.episodes,
                100.0 * r.success_rate,
                format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high),
                r.penalty_points,
                r.tier.title(),
                v.ee,
                v.link,
                v.joint_pos,
                v.joint_vel,
                v.computation_time,
                format!(
                    "{:.2} / {:.2} / {:.2}",
                    1e3 * t.mean,
                    1e3 * t.p99,
                    1e3 * t.max
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
