//! Text of an evaluation's status and of its results by task. A *tier* is the class of an agent by its penalty points.

use super::{queue::queue_text, table_cells::percent_interval};
use crate::competition::competition;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    task::TaskView,
};
use faceoff_types::{TaskMap, Tier};

/// Status of an evaluation in a few words.
pub(super) fn status_text(evaluation: &EvaluationView) -> String {
    if let Some(decision) = &evaluation.voided {
        return format!("voided: {}", decision.reason);
    }
    let progress = evaluation.progress;
    let position = match &evaluation.queue {
        Some(queue) => format!(", {}", queue_text(queue)),
        None => String::new(),
    };
    match &evaluation.status {
        EvaluationStatus::Queued => format!("queued{position}"),
        EvaluationStatus::Running => {
            format!(
                "running, {} of {} episodes{position}",
                progress.episodes_done, progress.episodes_total
            )
        }
        EvaluationStatus::Scoring => "computing the score".to_owned(),
        EvaluationStatus::Finished { result: None, .. } => "finished".to_owned(),
        EvaluationStatus::Finished {
            result: Some(result),
            ..
        } => format!(
            "finished: score {:.1}, {:.1} penalty points{}",
            result.score,
            result.penalty_points,
            tier_suffix(result.tier)
        ),
        EvaluationStatus::AgentFailed { .. } => "the agent failed".to_owned(),
        EvaluationStatus::PlatformFailed { reason, .. } => format!("platform fault: {reason}"),
        EvaluationStatus::DeadlineMissed { reason, .. } => format!("not evaluated: {reason}"),
        EvaluationStatus::Cancelled { reason, .. } => format!("cancelled: {reason}"),
    }
}

/// The tier at the end of a list; empty without tiers.
pub(super) fn tier_suffix(tier: Option<Tier>) -> String {
    tier.map_or_else(String::new, |tier| {
        format!(", {}", tier.title().to_lowercase())
    })
}

/// Table of the results by task.
pub(super) fn task_table(tasks: &TaskMap<TaskView>) -> String {
    let has_tiers = tasks.values().any(|result| result.tier.is_some());
    let tier_heading = if has_tiers { "  tier" } else { "" };
    let mut lines = vec![format!(
        "{:<8} {:>8} {:>9} {:>19} {:>8}{tier_heading}",
        "task", "episodes", "success", "95 % interval", "penalty"
    )];
    // JSON objects have no order, so the tasks are sorted as on boards.
    let tasks = competition()
        .task_names()
        .filter_map(|task| Some((task, tasks.get(&task)?)));
    lines.extend(tasks.map(|(task, result)| {
        format!(
            "{task:<8} {:>8} {:>7.1} % {:>19} {:>8.1}{}",
            result.episodes,
            100.0 * result.success_rate,
            percent_interval(result.success_ci95),
            result.penalty_points,
            result
                .tier
                .map_or_else(String::new, |tier| format!("  {}", tier.title()))
        )
    }));
    lines.join("\n")
}
