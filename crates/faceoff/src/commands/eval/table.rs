//! Table of an evaluation's result by task. A *tier* is the class of an agent by its penalty points.

use crate::commands::table_cells::{
    computation_time_cell, percent_interval, violation_cells, violation_headings,
};
use faceoff_types::{EvaluationResult, Tier};

/// The result as text. The columns from `ee` to `time` count the violations of each constraint: end effector, links, joint
/// positions, joint velocities, computation time.
pub(super) fn result_table(agent: &str, result: &EvaluationResult) -> String {
    // The column of the tiers with the space before it; empty without tiers.
    let tier_cell = |text: &str| match result.tier {
        Some(_) => format!("  {text:<15}"),
        None => String::new(),
    };
    let mut lines = Vec::new();
    lines.push(format!(
        "{agent}: {} ({}), seed {}",
        result.profile, result.ruleset, result.seed
    ));
    lines.push(format!(
        "\n{:<8} {:>8} {:>8} {:>17} {:>8}{} {}  {:>23}",
        "task",
        "episodes",
        "success",
        "95 % interval",
        "penalty",
        tier_cell("tier"),
        violation_headings(),
        "time mean/p99/max [ms]"
    ));
    for (task, task_result) in &result.tasks {
        lines.push(format!(
            "{task:<8} {:>8} {:>6.1} % {:>17} {:>8.1}{} {}  {:>23}",
            task_result.episodes,
            100.0 * task_result.success_rate,
            percent_interval(task_result.success_ci95),
            task_result.penalty_points,
            tier_cell(task_result.tier.map_or("", Tier::title)),
            violation_cells(&task_result.violations),
            computation_time_cell(task_result.computation_time_s),
        ));
    }
    lines.push(format!(
        "\nscore {:.1} %, penalty points {:.1}{}",
        result.score,
        result.penalty_points,
        result
            .tier
            .map_or_else(String::new, |tier| format!(", tier: {}", tier.title()))
    ));
    lines.join("\n") + "\n"
}
