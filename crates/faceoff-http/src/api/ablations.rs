//! Ablations: a submission under each perturbation alone. The organiser orders them; they take no turn
//! and reach no board.

use super::{
    evaluations::Progress,
    schema::{self, ProblemBody},
    submissions::visible,
};
use crate::{
    App,
    auth::{Caller, Organiser},
    extract::{OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
};
use axum::{Json, extract::State, http::StatusCode, response::IntoResponse};
use faceoff_scoring::ProfileEffect;
use faceoff_store::{Ablation, AblationState, Actor, RunPlan};
use faceoff_types::{SubmissionId, Task};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Episodes of each task and profile, unless the order says otherwise.
const DEFAULT_EPISODES: u32 = 100;
/// Most episodes of a task in one profile.
const MAX_EPISODES: u32 = 100_000;

/// What the ablation shall play. All fields may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OrderAblation {
    /// Episodes of each task in each of the six profiles; 100 unless given.
    pub episodes_per_task: Option<u32>,
}

/// An ablation of a submission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AblationView {
    /// The submission that plays.
    #[schema(value_type = String, format = Uuid)]
    pub submission: SubmissionId,
    /// Episodes of each task in each profile.
    pub episodes_per_task: u32,
    /// When it was ordered.
    #[schema(value_type = String, format = DateTime)]
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
    /// Done.
    Finished {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// By task: one entry per profile, `ideal` first.
        #[schema(value_type = BTreeMap<String, Vec<schema::ProfileEffect>>)]
        tasks: BTreeMap<Task, Vec<ProfileEffect>>,
    },
    /// It ended without a result.
    Failed {
        /// When.
        #[schema(value_type = String, format = DateTime)]
        finished_at: Timestamp,
        /// Why.
        reason: String,
    },
}

impl AblationView {
    pub(crate) async fn of(app: &App, ablation: Ablation) -> Result<Self, Problem> {
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
            AblationState::Finished { finished_at } => {
                let mut runs = BTreeMap::new();
                for (profile, run) in ablation.runs {
                    runs.insert(profile, app.store.outcomes(run).await?);
                }
                AblationStatus::Finished {
                    finished_at,
                    tasks: faceoff_scoring::ablation(&runs).map_err(Problem::internal)?,
                }
            }
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

/// The newest ablation of a submission; for its team and the organiser.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = 200, body = AblationView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn ablation(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<AblationView>, Problem> {
    visible(&app, &caller, id).await?;
    match app.store.newest_ablation(id).await? {
        Some(ablation) => Ok(Json(AblationView::of(&app, ablation).await?)),
        None => Err(Problem::not_found("ablation")),
    }
}

/// Orders an ablation: all tasks in all profiles, on episodes of their own. It is played when nothing
/// that counts waits.
#[utoipa::path(
    post, path = "/submissions/{id}/ablation", tag = "organiser", security(("organiser" = [])),
    params(("id" = String, Path, format = Uuid)),
    request_body(content = Option<OrderAblation>, content_type = "application/json"),
    responses(
        (status = 201, body = AblationView),
        (status = 404, body = ProblemBody, content_type = "application/problem+json"),
        (status = 409, description = "one is under way, the submission is not valid, or the season is closed", body = ProblemBody, content_type = "application/problem+json"),
        (status = 422, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn order_ablation(
    _: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(wanted): OptionalJson<OrderAblation>,
) -> Result<impl IntoResponse, Problem> {
    let episodes = wanted.episodes_per_task.unwrap_or(DEFAULT_EPISODES);
    if !(1..=MAX_EPISODES).contains(&episodes) {
        return Err(Problem::new(
            ProblemKind::InvalidContent,
            format!("episodes_per_task: expected 1 to {MAX_EPISODES}, got {episodes}"),
        )
        .with("field", "episodes_per_task"));
    }
    let plan = RunPlan {
        episodes_per_task: episodes,
        ..app.config.plan.clone()
    };
    let ablation = app
        .store
        .create_ablation(Actor::Organiser, id, &plan, app.config.clock.now())
        .await?;
    tracing::info!(submission = %id, ablation = %ablation.id, "ablation ordered");
    let view = AblationView::of(&app, ablation).await?;
    Ok((StatusCode::CREATED, Json(view)))
}
