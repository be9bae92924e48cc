//! Ablations: a submission under each perturbation alone. The organiser orders them; they take no turn
//! and reach no board.

use super::{
    clip_answer::send,
    document::{Binary, TagHeader},
    episodes::checked_episodes,
};
use axum::{
    Json,
    extract::State,
    http::{HeaderMap, StatusCode},
    response::{IntoResponse, Response},
};
use faceoff_api::{requests::OrderAblation, views::ablation::AblationView};
use faceoff_replay::Key;
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    conditions::{Conditions, ETag},
    episode_path::AblationPath,
    extract::{OptionalJson, PathParam},
    problem::Problem,
    viewer::Viewer,
    views::{ablation, ablation_clips::AblationClips, stage},
};
use faceoff_store::RunPlan;
use faceoff_types::{Profile, SubmissionId, Task};

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
    let newest = ablation::newest(&app, id).await?;
    newest
        .map(Json)
        .ok_or_else(|| Problem::not_found("ablation"))
}

/// The motion of table and robots in an episode of a submission's newest ablation, as a clip that replays are drawn from: of
/// the episodes that do not end as in the ideal simulator, in both. For everybody.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation/{profile}/{task}/{episode}/motion", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = SubmissionId, Path), ("profile" = Profile, Path), ("task" = Task, Path), ("episode" = u32, Path), TagHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404, description = "there is none, or it ended as in the ideal simulator"),
    )
)]
pub(crate) async fn ablation_motion(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: AblationPath,
) -> Result<Response, Problem> {
    let clips = AblationClips::of(&app, viewer, path.submission).await?;
    let key = Key::motion(path.task, path.episode);
    send_episode(&app, &clips, key, "motion", path, &conditions, &headers).await
}

/// What the agent was told and commanded in such an episode, and how long its answers took, as a clip; for its team and
/// organisers.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation/{profile}/{task}/{episode}/observed", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(
        ("id" = SubmissionId, Path), ("profile" = Profile, Path), ("task" = Task, Path), ("episode" = u32, Path), TagHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "another team's"),
        (status = 404, description = "there is none, or it ended as in the ideal simulator"),
    )
)]
pub(crate) async fn ablation_observed(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: AblationPath,
) -> Result<Response, Problem> {
    let clips = AblationClips::of(&app, viewer, path.submission).await?;
    if !clips.sees_observed {
        return Err(Problem::new(
            viewer.refusal(),
            "what an agent was told and commanded is its team's; the motion is there for everybody",
        ));
    }
    let key = Key::observed(path.task, path.episode);
    send_episode(&app, &clips, key, "observed", path, &conditions, &headers).await
}

async fn send_episode(
    app: &App,
    clips: &AblationClips,
    key: Key,
    what: &str,
    path: AblationPath,
    conditions: &Conditions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let file = clips.of_profile(app, path.profile).await?;
    let tag = ETag::of(
        what,
        &[&file.key, path.task.as_str(), &path.episode.to_string()],
    );
    send(&tag, conditions, headers, file.clip(key)).await
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
    let view = ablation::of(&app, ablation).await?;
    Ok((StatusCode::CREATED, Json(view)))
}
