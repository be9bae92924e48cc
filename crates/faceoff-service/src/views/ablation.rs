//! Ablations. An *ablation* runs one submission in the ideal simulator, under each kind of perturbation alone, and under all of them
//! (the *profiles*), on the same episodes. It shows what each perturbation costs the agent.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_api::views::{
    ablation::{AblationStatus, AblationView},
    evaluation::Progress,
};
use faceoff_scoring::ProfileEffect;
use faceoff_store::{Ablation, AblationState};
use faceoff_types::{ProfileMap, RunId, SubmissionId, TaskMap};

/// The newest ablation of a submission, if it has one.
#[boxed_future]
pub async fn newest(
    app: &AppState,
    submission: SubmissionId,
) -> Result<Option<AblationView>, Problem> {
    match app.store.newest_ablation(submission).await? {
        Some(ablation) => build(app, ablation).await.map(Some),
        None => Ok(None),
    }
}

/// An ablation: its progress while it is running, then the effect of each profile.
#[boxed_future]
pub async fn build(app: &AppState, ablation: Ablation) -> Result<AblationView, Problem> {
    let status = match ablation.state {
        AblationState::Unfinished {
            progress,
            episodes_total,
        } => AblationStatus::Unfinished {
            progress: Progress {
                episodes_done: progress.episodes_visible_to_team(app.config.clock.now()),
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
#[boxed_future]
pub async fn exists(app: &AppState, submission: SubmissionId) -> Result<bool, Problem> {
    Ok(app.store.newest_ablation(submission).await?.is_some())
}

/// The effects of the profiles by task, from the summaries of their runs (all episodes under one profile).
async fn effects(
    app: &AppState,
    mut runs: ProfileMap<RunId>,
) -> Result<TaskMap<Vec<ProfileEffect>>, Problem> {
    let competition = app.config.competition();
    competition.sort_profiles(&mut runs);
    let run_ids: Vec<_> = runs.values().copied().collect();
    let summaries = app.summaries.load(&run_ids).await?;
    let summaries_by_profile: ProfileMap<_> = runs
        .into_iter()
        .filter_map(|(profile, run)| Some((profile, summaries.get(&run)?.as_ref())))
        .collect();
    faceoff_scoring::ablation(&summaries_by_profile, competition.ideal_profile)
        .map_err(Problem::internal)
}
