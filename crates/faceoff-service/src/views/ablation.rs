//! Ablations: what each perturbation costs an agent.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::{
    ablation::{AblationStatus, AblationView},
    evaluation::Progress,
};
use faceoff_scoring::ProfileEffect;
use faceoff_store::{Ablation, AblationState};
use faceoff_types::{Profile, RunId, SubmissionId, Task};
use std::collections::BTreeMap;

/// The newest ablation of a submission, if it has one.
#[boxed]
pub async fn newest(
    app: &AppState,
    submission: SubmissionId,
) -> Result<Option<AblationView>, Problem> {
    match app.store.newest_ablation(submission).await? {
        Some(ablation) => build(app, ablation).await.map(Some),
        None => Ok(None),
    }
}

/// An ablation with its progress, or its effects.
#[boxed]
pub async fn build(app: &AppState, ablation: Ablation) -> Result<AblationView, Problem> {
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

/// Whether the submission has an ablation, in any state.
#[boxed]
pub async fn exists(app: &AppState, submission: SubmissionId) -> Result<bool, Problem> {
    Ok(app.store.newest_ablation(submission).await?.is_some())
}

/// The effects of the profiles, from the summaries of their runs.
async fn effects(
    app: &AppState,
    runs: BTreeMap<Profile, RunId>,
) -> Result<BTreeMap<Task, Vec<ProfileEffect>>, Problem> {
    let ids: Vec<_> = runs.values().copied().collect();
    let summaries = app.summaries.load(&ids).await?;
    let profiles: BTreeMap<_, _> = runs
        .into_iter()
        .filter_map(|(profile, run)| Some((profile, summaries.get(&run)?.as_ref())))
        .collect();
    faceoff_scoring::ablation(&profiles).map_err(Problem::internal)
}
