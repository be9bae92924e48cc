//! Text of an ablation: how much worse an agent does with each perturbation alone, and with all, than under ideal conditions.

use faceoff_api::views::ablation::{AblationStatus, AblationView};

/// Formats an ablation for people.
pub(super) fn ablation_text(view: &AblationView) -> String {
    let mut lines = vec![format!(
        "ablation of {}, {} episodes per task and profile",
        view.submission, view.episodes_per_task
    )];
    match &view.status {
        AblationStatus::Unfinished { progress } => lines.push(format!(
            "{} of {} episodes finished",
            progress.episodes_done, progress.episodes_total
        )),
        AblationStatus::Failed { reason, .. } => lines.push(format!("no result: {reason}")),
        AblationStatus::Finished { tasks, .. } => {
            for (task, effects) in tasks {
                lines.extend(effects.iter().map(|effect| {
                    format!(
                        "{task:<8} {:<17} {:>6.1} %, {:+.1} against ideal, p {:.4}, {:.1} penalty points",
                        effect.profile.to_string(),
                        100.0 * effect.success_rate,
                        100.0 * effect.difference,
                        effect.p_value,
                        effect.penalty_points
                    )
                }));
            }
        }
    }
    lines.join("\n")
}
