//! Episodes of evaluations, and their clips: the data of one episode for the replay viewer.

use super::{
    clip_response::send,
    document::{Binary, IfNoneMatchHeader},
    downloads::send_tagged,
};
use axum::{
    Json,
    extract::State,
    http::HeaderMap,
    response::{IntoResponse, Response},
};
use faceoff_api::views::episodes::EpisodesView;
use faceoff_replay::ClipKey;
use faceoff_service::{
    app::App,
    episode_path::EpisodePath,
    extract::PathParam,
    problem::Problem,
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::{clips::Clips, visibility::Visibility},
};
use faceoff_types::EvaluationId;

/// Returns the episodes of an evaluation, once its day is released: start, end, outcome and violations.
///
/// Public. Computation times and details of agent faults need access to the dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), IfNoneMatchHeader),
    responses(
        (status = 200, body = EpisodesView),
        (status = 404),
        (status = 409, description = "no result, its day is not released, its stage hides results (blind) or its boards are frozen, or an older server version ran it"),
        (status = 410, description = "the recording was removed; the detail says when and by which retention rule"),
    )
)]
pub(crate) async fn episodes(
    viewer: Viewer,
    conditions: RequestPreconditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let visibility = Visibility::load(&app, viewer).await?;
    let clips = Clips::find(&app, &visibility, id).await?;
    let detail = if clips.can_see_observations {
        "all"
    } else {
        "public"
    };
    let tag = ETag::new(
        "episodes",
        &[&clips.file.key, detail, env!("CARGO_PKG_VERSION")],
    );
    let episodes = async { Ok(Json(clips.episodes().await?).into_response()) };
    send_tagged(&tag, &conditions, episodes).await
}

/// Returns the motion of table and robots in an episode, as a binary clip. Public once the day is released.
///
/// `docs/replay.md` describes the format. The response is gzip-compressed if the client accepts that.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/motion", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), IfNoneMatchHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "no result, its day is not released, its stage hides results (blind) or its boards are frozen, or an older server version ran it"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn motion(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let visibility = Visibility::load(&app, viewer).await?;
    let clips = Clips::find(&app, &visibility, path.id).await?;
    let key = ClipKey::motion(path.task, path.episode);
    send_episode(&clips, key, "motion", path, &conditions, &headers).await
}

/// Returns the agent's observations, actions and computation times in an episode, as a binary clip. Needs access to the
/// dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/observed", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), IfNoneMatchHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "the evaluation belongs to another team and is not public"),
        (status = 404),
        (status = 409, description = "no result, its day is not released, its stage hides results (blind) or its boards are frozen, or an older server version ran it"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn observed(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let visibility = Visibility::load(&app, viewer).await?;
    let clips = Clips::find(&app, &visibility, path.id).await?;
    if !clips.can_see_observations {
        return Err(Problem::new(
            viewer.denial_kind(),
            "observations and actions are visible only to the agent's team until the dataset is public; the motion is \
             public",
        ));
    }
    let key = ClipKey::observed(path.task, path.episode);
    send_episode(&clips, key, "observed", path, &conditions, &headers).await
}

async fn send_episode(
    clips: &Clips,
    key: ClipKey,
    tag_prefix: &str,
    path: EpisodePath,
    conditions: &RequestPreconditions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let EpisodePath { task, episode, .. } = path;
    let tag = ETag::new(
        tag_prefix,
        &[&clips.file.key, task.as_str(), &episode.to_string()],
    );
    send(&tag, conditions, headers, clips.clip(key)).await
}
