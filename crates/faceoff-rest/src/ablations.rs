//! Ablations: evaluations of a submission in the ideal simulator, with each perturbation (such as noise) alone, and with all
//! of them. Each of these conditions is a *profile*. Organisers start ablations, whose results never count.

use super::{
    clip_response::send,
    document::{Binary, IfNoneMatchHeader},
    episode_count::checked_episodes,
};
use axum::{
    Json,
    extract::State,
    http::{HeaderMap, StatusCode},
    response::{IntoResponse, Response},
};
use faceoff_api::{requests::NewAblation, views::ablation::AblationView};
use faceoff_replay::ClipKey;
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    episode_path::AblationPath,
    extract::{OptionalJson, PathParam},
    problem::Problem,
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::{ablation, ablation_clips::AblationClips, stage},
};
use faceoff_store::RunPlan;
use faceoff_types::{Profile, SubmissionId, Task};

/// Default number of episodes per task and profile.
const DEFAULT_EPISODES: u32 = 100;

/// Returns the newest ablation of a submission. For its team and organisers.
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

/// Returns the motion of table and robots in an episode of a submission's newest ablation, as a binary clip. Public.
///
/// A perturbed profile has clips of the episodes whose outcome differs from the ideal simulator's; the profile `ideal` has
/// clips of the same episodes for comparison. `docs/replay.md` describes the format.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation/{profile}/{task}/{episode}/motion", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = SubmissionId, Path), ("profile" = Profile, Path), ("task" = Task, Path), ("episode" = u32, Path), IfNoneMatchHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404, description = "no such episode, or its outcome equals the ideal simulator's"),
    )
)]
pub(crate) async fn ablation_motion(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: AblationPath,
) -> Result<Response, Problem> {
    let clips = AblationClips::load(&app, viewer, path.submission).await?;
    let key = ClipKey::motion(path.task, path.episode);
    send_episode(&app, &clips, key, "motion", path, &conditions, &headers).await
}

/// Returns the agent's observations, actions and computation times in an episode of a submission's newest ablation, as
/// a binary clip. For its team and organisers.
#[utoipa::path(
    get, path = "/submissions/{id}/ablation/{profile}/{task}/{episode}/observed", tag = "team",
    security(("team" = []), ("organiser" = [])),
    params(
        ("id" = SubmissionId, Path), ("profile" = Profile, Path), ("task" = Task, Path), ("episode" = u32, Path), IfNoneMatchHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "the submission belongs to another team"),
        (status = 404, description = "no such episode, or its outcome equals the ideal simulator's"),
    )
)]
pub(crate) async fn ablation_observed(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: AblationPath,
) -> Result<Response, Problem> {
    let clips = AblationClips::load(&app, viewer, path.submission).await?;
    if !clips.can_see_observations {
        return Err(Problem::new(
            viewer.denial_kind(),
            "observations and actions are visible only to the agent's team; the motion is public",
        ));
    }
    let key = ClipKey::observed(path.task, path.episode);
    send_episode(&app, &clips, key, "observed", path, &conditions, &headers).await
}

async fn send_episode(
    app: &App,
    clips: &AblationClips,
    key: ClipKey,
    tag_prefix: &str,
    path: AblationPath,
    conditions: &RequestPreconditions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let file = clips.profile_file(app, path.profile).await?;
    let tag = ETag::new(
        tag_prefix,
        &[&file.key, path.task.as_str(), &path.episode.to_string()],
    );
    send(&tag, conditions, headers, file.clip(key)).await
}

/// Starts an ablation: all tasks in each of its profiles, on episodes that no evaluation uses.
///
/// Its jobs run when no job that counts is pending.
#[utoipa::path(
    post, operation_id = "order_ablation", path = "/submissions/{id}/ablation", tag = "organiser", security(("organiser" = [])),
    params(("id" = SubmissionId, Path)),
    request_body(content = Option<NewAblation>, content_type = "application/json"),
    responses(
        (status = 201, body = AblationView),
        (status = 404),
        (status = 409, description = "an ablation is running, the submission is not valid, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_ablation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<SubmissionId>,
    OptionalJson(request): OptionalJson<NewAblation>,
) -> Result<impl IntoResponse, Problem> {
    let episodes = request.episodes_per_task.unwrap_or(DEFAULT_EPISODES);
    let plan = RunPlan {
        tasks: app.config.competition().task_names().collect(),
        episodes_per_task: checked_episodes(episodes)?,
        ..stage::current(&app).await?.plan()
    };
    let profiles: Vec<Profile> = app.config.competition().ablation_profiles().collect();
    let ruleset = app.config.competition().ruleset();
    let now = app.config.clock.now();
    let ablation = app
        .store
        .request_ablation(organiser.actor(), id, ruleset, &plan, &profiles, now)
        .await?;
    tracing::info!(submission = %id, ablation = %ablation.id, "ablation queued");
    let view = ablation::build(&app, ablation).await?;
    Ok((StatusCode::CREATED, Json(view)))
}
