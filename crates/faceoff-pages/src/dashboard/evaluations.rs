//! The latest evaluations of a team, with what only the team sees: dataset, agent faults and log.

use crate::format::{self, utc_minute};
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView};
use faceoff_service::{
    app::AppState,
    problem::Problem,
    viewer::Viewer,
    views::{evaluation, visibility::Visibility},
};
use faceoff_types::{EvaluationId, TeamId};

/// An evaluation as its team sees it.
pub(super) struct EvaluationRow {
    pub(super) id: EvaluationId,
    pub(super) day: String,
    pub(super) state: String,
    pub(super) score: Option<String>,
    /// Episodes done and in total, while the evaluation is not final.
    pub(super) progress: Option<(u32, u32)>,
    /// What happens next, as a sentence.
    pub(super) next_step: String,
    /// Address of the dataset.
    pub(super) dataset: Option<String>,
    /// Agent faults that ended the evaluation.
    pub(super) faults: Vec<String>,
    pub(super) log: Option<String>,
}

/// Evaluations of a team, newest first.
pub(super) async fn of_team(
    app: &AppState,
    team: TeamId,
    limit: usize,
) -> Result<Vec<EvaluationRow>, Problem> {
    let visibility = Visibility::load(app, Viewer::Team(team)).await?;
    let mut evaluations = app.store.evaluations_of(team).await?;
    evaluations.sort_by_key(|evaluation| std::cmp::Reverse(evaluation.created_at));
    evaluations.truncate(limit);
    let mut rows = Vec::new();
    for evaluation in evaluations {
        let view = evaluation::build(app, &visibility, evaluation).await?;
        rows.push(evaluation_row(&visibility, view));
    }
    Ok(rows)
}

fn evaluation_row(visibility: &Visibility, view: EvaluationView) -> EvaluationRow {
    let scored_at = view.status.finished_at();
    let is_hidden_by_freeze = scored_at
        .is_some_and(|scored_at| visibility.hiding_freeze(view.stage, scored_at).is_some());
    let mut row = EvaluationRow {
        id: view.id,
        day: view.day.to_string(),
        state: String::new(),
        score: None,
        progress: (!view.status.is_final())
            .then_some((view.progress.episodes_done, view.progress.episodes_total)),
        next_step: view.next,
        dataset: None,
        faults: Vec::new(),
        log: None,
    };
    row.state = match view.status {
        EvaluationStatus::Queued => "waiting for a free slot".to_owned(),
        EvaluationStatus::Running => "running".to_owned(),
        EvaluationStatus::Scoring => "computing the score".to_owned(),
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. } if view.blind => {
            "finished; the stage is blind".to_owned()
        }
        EvaluationStatus::Finished { .. } if is_hidden_by_freeze => {
            "finished; the boards of the stage are frozen".to_owned()
        }
        EvaluationStatus::Finished {
            result, dataset, ..
        } => {
            row.score = result.map(|result| format::one_decimal(result.score));
            row.dataset = dataset.filter(|_| view.released_at.is_some());
            "finished".to_owned()
        }
        EvaluationStatus::AgentFailed { faults, log, .. } => {
            let faults = faults.unwrap_or_default();
            row.faults = faults
                .into_iter()
                .map(|fault| match (fault.episode, fault.step) {
                    (Some(episode), Some(step)) => format!(
                        "{}, episode {episode}, step {step}: {}",
                        fault.task, fault.message
                    ),
                    (Some(episode), None) => {
                        format!("{}, episode {episode}: {}", fault.task, fault.message)
                    }
                    _ => format!("{}: {}", fault.task, fault.message),
                })
                .collect();
            row.log = log.filter(|log| !log.is_empty());
            "stopped after agent faults, no score".to_owned()
        }
        EvaluationStatus::PlatformFailed { .. } => "platform fault".to_owned(),
        EvaluationStatus::DeadlineMissed { .. } => "not evaluated in time".to_owned(),
        EvaluationStatus::Cancelled {
            finished_at,
            reason,
        } => {
            format!("cancelled {}: {reason}", utc_minute(finished_at))
        }
    };
    if let Some(decision) = view.voided {
        row.state
            .push_str(&format!("; voided: {}", decision.reason));
    }
    row
}
