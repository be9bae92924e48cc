//! Ablations: a submission under each perturbation alone. The organiser orders them; they take no turn
//! and reach no board.

use super::episodes::checked_episodes;
use crate::{
    app::App,
    auth::{Caller, Organiser},
    extract::{OptionalJson, PathParam},
    problem::Problem,
    requests::OrderAblation,
    views::{ablation::AblationView, stage},
};
use axum::{Json, extract::State, http::StatusCode, response::IntoResponse};
use faceoff_store::RunPlan;
use faceoff_types::SubmissionId;

/// Episodes of each task and profile, unless the order says otherwise.
const DEFAULT_EPISODES: u32 = 100;

/// The newest ablation of a submission; for its team and the organiser.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    responses((status = 200, body = AblationView), (status = 404))
)]
pub(crate) async fn ablation(
    caller: Caller,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
) -> Result<Json<AblationView>, Problem> {
    let submission = app.store.submission(id).await;
    caller.visible("submission", submission, |submission| submission.team)?;
    let newest = AblationView::newest(&app, id).await?;
    newest
        .map(Json)
        .ok_or_else(|| Problem::not_found("ablation"))
}

/// Orders an ablation: all tasks in all profiles, on episodes of their own. It is played when nothing
/// that counts waits.
#[utoipa::path(
    post, path = "/submissions/{id}/ablation", tag = "organiser", security(("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<OrderAblation>, content_type = "application/json"),
    responses(
        (status = 201, body = AblationView),
        (status = 404),
        (status = 409, description = "one is under way, the submission is not valid, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn order_ablation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(wanted): OptionalJson<OrderAblation>,
) -> Result<impl IntoResponse, Problem> {
    let episodes = wanted.episodes_per_task.unwrap_or(DEFAULT_EPISODES);
    let plan = RunPlan {
        episodes_per_task: checked_episodes(episodes)?,
        ..stage::current(&app).await?.plan()
    };
    let ablation = app
        .store
        .create_ablation(organiser.actor(), id, &plan, app.config.clock.now())
        .await?;
    tracing::info!(submission = %id, ablation = %ablation.id, "ablation ordered");
    let view = AblationView::of(&app, ablation).await?;
    Ok((StatusCode::CREATED, Json(view)))
}
