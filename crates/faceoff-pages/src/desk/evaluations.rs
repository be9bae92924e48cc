//! What a team has played of late, with its files.

use crate::figures::{self, minute};
use faceoff_api::views::evaluation::{EvaluationStatus, EvaluationView};
use faceoff_service::{
    app::AppState,
    problem::Problem,
    viewer::Viewer,
    views::{evaluation, sight::Sight},
};
use faceoff_types::{EvaluationId, TeamId};

/// An evaluation, for its team.
pub(super) struct Played {
    pub(super) id: EvaluationId,
    pub(super) day: String,
    pub(super) state: String,
    pub(super) score: Option<String>,
    /// Episodes played and to play, while it is under way.
    pub(super) progress: Option<(u32, u32)>,
    pub(super) next: String,
    pub(super) dataset: Option<String>,
    /// What the agent did wrong, where that ended it.
    pub(super) faults: Vec<String>,
    pub(super) log: Option<String>,
}

/// The newest evaluations of a team.
pub(super) async fn of_team(
    app: &AppState,
    team: TeamId,
    most: usize,
) -> Result<Vec<Played>, Problem> {
    let sight = Sight::of(app, Viewer::Team(team)).await?;
    let mut evaluations = app.store.evaluations_of(team).await?;
    evaluations.sort_by_key(|evaluation| std::cmp::Reverse(evaluation.created_at));
    evaluations.truncate(most);
    let mut played = Vec::new();
    for evaluation in evaluations {
        let view = evaluation::of(app, &sight, evaluation).await?;
        played.push(of_view(&sight, view));
    }
    Ok(played)
}

fn of_view(sight: &Sight, view: EvaluationView) -> Played {
    let scored_at = view.status.finished_at();
    let is_frozen = scored_at.is_some_and(|at| sight.freeze_hiding(view.stage, at).is_some());
    let mut played = Played {
        id: view.id,
        day: view.day.to_string(),
        state: String::new(),
        score: None,
        progress: (!view.status.is_final())
            .then_some((view.progress.episodes_done, view.progress.episodes_total)),
        next: view.next,
        dataset: None,
        faults: Vec::new(),
        log: None,
    };
    let hidden = "over; its stage is blind";
    played.state = match view.status {
        EvaluationStatus::Queued => "waits for a slot".to_owned(),
        EvaluationStatus::Running => "is played".to_owned(),
        EvaluationStatus::Finalising => "is scored".to_owned(),
        EvaluationStatus::Finished { .. } | EvaluationStatus::AgentFailed { .. } if view.blind => {
            hidden.to_owned()
        }
        EvaluationStatus::Finished { .. } if is_frozen => {
            "finished; the boards of its stage are frozen".to_owned()
        }
        EvaluationStatus::Finished {
            result, dataset, ..
        } => {
            played.score = result.map(|result| figures::one(result.score));
            played.dataset = dataset.filter(|_| view.released_at.is_some());
            "finished".to_owned()
        }
        EvaluationStatus::AgentFailed { faults, log, .. } => {
            let faults = faults.unwrap_or_default();
            played.faults = faults
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
            played.log = log.filter(|log| !log.is_empty());
            "ended by the agent’s faults, without a score".to_owned()
        }
        EvaluationStatus::PlatformFailed { .. } => "failed by the server’s fault".to_owned(),
        EvaluationStatus::NotPlayed { .. } => "not played in time".to_owned(),
        EvaluationStatus::Cancelled {
            finished_at,
            reason,
        } => {
            format!("cancelled {}: {reason}", minute(finished_at))
        }
    };
    if let Some(ruling) = view.voided {
        played
            .state
            .push_str(&format!("; voided: {}", ruling.reason));
    }
    played
}
