use crate::commands::team_server::in_queue;
use faceoff_http::views::evaluation::{EvaluationStatus, EvaluationView};

/// An evaluation in a line.
pub(super) fn line(evaluation: &EvaluationView) -> String {
    if let Some(ruling) = &evaluation.voided {
        let (team, id) = (&evaluation.team_name, evaluation.id);
        return format!("{team:<40} {id}  voided: {}", ruling.reason);
    }
    let progress = evaluation.progress;
    let place = match &evaluation.queue {
        Some(queue) => format!(", {}", in_queue(queue)),
        None => String::new(),
    };
    let state = match &evaluation.status {
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
    };
    format!("{:<40} {}  {state}", evaluation.team_name, evaluation.id)
}
