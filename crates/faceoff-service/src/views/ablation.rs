//! What each perturbation costs an agent.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::{
    ablation::{AblationStatus, AblationView},
    evaluation::Progress,
};
use faceoff_scoring::ProfileEffect;
use faceoff_store::{Ablation, AblationState};
use faceoff_types::{Profile, RunId, SubmissionId, Task};
use std::collections::BTreeMap;

/// The newest ablation of a submission, if there was one.
#[boxed]
pub async fn newest(
    app: &AppState,
    submission: SubmissionId,
) -> Result<Option<AblationView>, Problem> {
    match app.store.newest_ablation(submission).await? {
        Some(ablation) => of(app, ablation).await.map(Some),
        None => Ok(None),
    }
}

/// With its progress, or its effects.
#[boxed]
pub async fn of(app: &AppState, ablation: Ablation) -> Result<AblationView, Problem> {
    let status = match ablation.state {
        AblationState::Open {
            episodes_done,
            episodes_total,
        } => AblationStatus::Open {
            progress: Progress {
                episodes_done,
                episodes_total,
            },
        },
        AblationState::Finished { finished_at } => AblationStatus::Finished {
            finished_at,
            tasks: effects(app, ablation.runs).await?,
        },
        AblationState::Failed {
            finished_at,
            reason,
        } => AblationStatus::Failed {
            finished_at,
            reason,
        },
    };
    Ok(AblationView {
        submission: ablation.submission,
        episodes_per_task: ablation.episodes_per_task,
        created_at: ablation.created_at,
        status,
    })
}

/// Has the submission an ablation, whatever became of it?
#[boxed]
pub async fn exists(app: &AppState, submission: SubmissionId) -> Result<bool, Problem> {
    Ok(app.store.newest_ablation(submission).await?.is_some())
}

/// From the summaries of the profiles' runs.
async fn effects(
    app: &AppState,
    runs: BTreeMap<Profile, RunId>,
) -> Result<BTreeMap<Task, Vec<ProfileEffect>>, Problem> {
    let ids: Vec<_> = runs.values().copied().collect();
    let summaries = app.summaries.of(&ids).await?;
    let profiles: BTreeMap<_, _> = runs
        .into_iter()
        .filter_map(|(profile, run)| Some((profile, summaries.get(&run)?.as_ref())))
        .collect();
    faceoff_scoring::ablation(&profiles).map_err(Problem::internal)
}
