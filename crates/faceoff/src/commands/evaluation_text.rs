use super::queue::in_queue;
use faceoff_api::views::{
    evaluation::{EvaluationStatus, EvaluationView},
    task::TaskView,
};
use faceoff_types::Task;
use std::collections::BTreeMap;

/// What has become of an evaluation, in words.
pub(super) fn state(evaluation: &EvaluationView) -> String {
    if let Some(ruling) = &evaluation.voided {
        return format!("voided: {}", ruling.reason);
    }
    let progress = evaluation.progress;
    let place = match &evaluation.queue {
        Some(queue) => format!(", {}", in_queue(queue)),
        None => String::new(),
    };
    match &evaluation.status {
        EvaluationStatus::Queued => format!("queued{place}"),
        EvaluationStatus::Running => {
            format!(
                "running, {} of {} episodes{place}",
                progress.episodes_done, progress.episodes_total
            )
        }
        EvaluationStatus::Finalising => "computing the score".to_owned(),
        EvaluationStatus::Finished { result: None, .. } => "finished".to_owned(),
        EvaluationStatus::Finished {
            result: Some(result),
            ..
        } => format!(
            "finished: score {:.1}, {:.1} penalty points, {}",
            result.score,
            result.penalty_points,
            result.tier.title().to_lowercase()
        ),
        EvaluationStatus::AgentFailed { .. } => "the agent failed".to_owned(),
        EvaluationStatus::PlatformFailed { reason, .. } => format!("our fault: {reason}"),
        EvaluationStatus::NotPlayed { reason, .. } => format!("not played: {reason}"),
        EvaluationStatus::Cancelled { reason, .. } => format!("cancelled: {reason}"),
    }
}

/// The results by task.
pub(super) fn tasks(tasks: &BTreeMap<Task, TaskView>) -> String {
    let mut lines = vec![format!(
        "{:<8} {:>8} {:>9} {:>19} {:>8}  tier",
        "task", "episodes", "success", "95 % interval", "penalty"
    )];
    lines.extend(tasks.iter().map(|(task, of)| {
        let [low, high] = of.success_ci95.map(|bound| 100.0 * bound);
        format!(
            "{task:<8} {:>8} {:>7.1} % {:>19} {:>8.1}  {}",
            of.episodes,
            100.0 * of.success_rate,
            format!("{low:.1} to {high:.1} %"),
            of.penalty_points,
            of.tier.title()
        )
    }));
    lines.join("\n")
}
