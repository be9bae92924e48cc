//! How an evaluation's episodes went, and the clips that their replays are drawn from.

use super::{
    clip_answer::send,
    document::{Binary, TagHeader},
    downloads::stays_its_callers,
};
use axum::{
    Json,
    extract::State,
    http::{HeaderMap, header},
    response::{IntoResponse, Response},
};
use faceoff_api::views::clips::EpisodesView;
use faceoff_replay::Key;
use faceoff_service::{
    app::App,
    conditions::{Conditions, ETag},
    episode_path::EpisodePath,
    extract::PathParam,
    problem::Problem,
    viewer::Viewer,
    views::{clips::Clips, sight::Sight},
};
use faceoff_types::EvaluationId;

/// How the episodes of an evaluation went, once its day is released: where each began and ended and why, and what it broke.
///
/// Everybody sees it, as the result. Computation times, and what exactly a faulty agent did, are for whoever gets the dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), TagHeader),
    responses(
        (status = 200, body = EpisodesView),
        (status = 404),
        (status = 409, description = "no result, its day is not released, its stage is blind or its boards frozen; or an older version of the server played it"),
        (status = 410, description = "the recording was removed; the detail says when and by which retention"),
    )
)]
pub(crate) async fn episodes(
    viewer: Viewer,
    conditions: Conditions,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, id).await?;
    let seen = if clips.sees_observed { "all" } else { "some" };
    let tag = ETag::of(
        "episodes",
        &[&clips.file.key, seen, env!("CARGO_PKG_VERSION")],
    );
    let mut answer = match conditions.not_modified(&tag) {
        Some(answer) => answer,
        None => {
            let view = clips.episodes().await?;
            ([(header::ETAG, tag.header())], Json(view)).into_response()
        }
    };
    stays_its_callers(answer.headers_mut());
    Ok(answer)
}

/// The motion of table and robots in an episode, as a clip that replays are drawn from; for everybody, once the day is released.
///
/// Its bytes are described in `docs/replay.md`. They come gzip-compressed, for whoever accepts that.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/motion", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), TagHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "as for the episodes"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn motion(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, path.id).await?;
    let key = Key::motion(path.task, path.episode);
    send_episode(&clips, key, "motion", path, &conditions, &headers).await
}

/// What the agent was told and commanded in an episode, and how long its answers took, as a clip; for whoever gets the
/// dataset.
#[utoipa::path(
    get, path = "/evaluations/{id}/episodes/{task}/{episode}/observed", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("task" = faceoff_types::Task, Path), ("episode" = u32, Path), TagHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "another team's, and not public"),
        (status = 404),
        (status = 409, description = "as for the episodes"),
        (status = 410, description = "the recording was removed"),
    )
)]
pub(crate) async fn observed(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    path: EpisodePath,
) -> Result<Response, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let clips = Clips::of(&app, &sight, path.id).await?;
    if !clips.sees_observed {
        return Err(Problem::new(
            viewer.refusal(),
            "what an agent was told and commanded is its team's, until the dataset is public; the motion is there for \
             everybody",
        ));
    }
    let key = Key::observed(path.task, path.episode);
    send_episode(&clips, key, "observed", path, &conditions, &headers).await
}

async fn send_episode(
    clips: &Clips,
    key: Key,
    what: &str,
    path: EpisodePath,
    conditions: &Conditions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let EpisodePath { task, episode, .. } = path;
    let tag = ETag::of(
        what,
        &[&clips.file.key, task.as_str(), &episode.to_string()],
    );
    send(&tag, conditions, headers, clips.clip(key)).await
}
