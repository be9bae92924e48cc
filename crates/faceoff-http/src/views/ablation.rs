//! What each perturbation costs an agent.

use super::evaluation::Progress;
use crate::{app::AppState, problem::Problem};
use faceoff_scoring::ProfileEffect;
use faceoff_store::{Ablation, AblationState};
use faceoff_types::{Profile, RunId, SubmissionId, Task};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// An ablation of a submission: its agent under each perturbation alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AblationView {
    /// The submission that plays.
    pub submission: SubmissionId,
    /// Episodes of each task in each profile.
    pub episodes_per_task: u32,
    /// When it was ordered.
    pub created_at: Timestamp,
    /// What has become of it.
    #[serde(flatten)]
    pub status: AblationStatus,
}

/// What has become of an ablation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum AblationStatus {
    /// It waits behind what counts, or is being played.
    Open {
        /// Over all profiles and tasks.
        progress: Progress,
    },
    /// All profiles are played.
    Finished {
        /// When the last episode was stored.
        finished_at: Timestamp,
        /// By task: one entry per profile, `ideal` first.
        tasks: BTreeMap<Task, Vec<ProfileEffect>>,
    },
    /// It ended without a result.
    Failed {
        /// When the run that failed was stored.
        finished_at: Timestamp,
        /// Whose fault it was, and which.
        reason: String,
    },
}

impl AblationView {
    /// The newest ablation of a submission, if there was one.
    pub(crate) async fn newest(
        app: &AppState,
        submission: SubmissionId,
    ) -> Result<Option<Self>, Problem> {
        match app.store.newest_ablation(submission).await? {
            Some(ablation) => Self::of(app, ablation).await.map(Some),
            None => Ok(None),
        }
    }

    pub(crate) async fn of(app: &AppState, ablation: Ablation) -> Result<Self, Problem> {
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
        Ok(Self {
            submission: ablation.submission,
            episodes_per_task: ablation.episodes_per_task,
            created_at: ablation.created_at,
            status,
        })
    }
}

/// Has the submission an ablation, whatever became of it?
pub(crate) async fn exists(app: &AppState, submission: SubmissionId) -> Result<bool, Problem> {
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
