//! Clips of games: data for the replay viewer, 500 control steps of the game each. A clip is identified by its number
//! (`chunk`), from 0.

use super::{
    clip_response::send,
    document::{Binary, IfNoneMatchHeader},
    game_files::parse_side,
};
use axum::{extract::State, http::HeaderMap, response::Response};
use faceoff_replay::ClipKey;
use faceoff_service::{
    app::App,
    extract::{PathParams, parse_path_param},
    problem::{Problem, ProblemKind},
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::game_clips::GameClips,
};
use faceoff_types::GameId;

/// Returns the motion of table and robots in a part of a game, as a binary clip: 500 control steps from 500 × `chunk`
/// on. For everyone who may see the game.
#[utoipa::path(
    get, path = "/games/{id}/motion/{chunk}", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("chunk" = u32, Path), IfNoneMatchHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "the game has no result or no recording, or an older server version ran it"),
    )
)]
pub(crate) async fn game_motion(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let [id, chunk] = path;
    let (id, chunk) = (parse_path_param(&id)?, parse_chunk(&chunk)?);
    let clips = GameClips::find(&app, viewer, id).await?;
    let tag = ETag::new("motion", &[&clips.file.key, &chunk.to_string()]);
    send(
        &tag,
        &conditions,
        &headers,
        clips.clip(ClipKey::game_motion(chunk)),
    )
    .await
}

/// Returns a side's observations, actions and computation times in a part of a game, as a binary clip. Needs access to
/// the side's recording.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}/observed/{chunk}", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away"),
        ("chunk" = u32, Path), IfNoneMatchHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "the side belongs to another team, and the recording is not public"),
        (status = 404),
        (status = 409, description = "the game has no result or no recording, or an older server version ran it"),
    )
)]
pub(crate) async fn game_observed(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParams(path): PathParams<String, 3>,
) -> Result<Response, Problem> {
    let [id, side, chunk] = path;
    let (id, side) = parse_side(&[id, side])?;
    let chunk = parse_chunk(&chunk)?;
    let clips = GameClips::find(&app, viewer, id).await?;
    if !clips.can_see_observations[side.index()] {
        return Err(Problem::new(
            viewer.denial_kind(),
            "observations and actions are visible only to the side's team until the recording is public; the motion is \
             public",
        ));
    }
    let parts = [
        clips.file.key.as_str(),
        &side.number().to_string(),
        &chunk.to_string(),
    ];
    let tag = ETag::new("observed", &parts);
    send(
        &tag,
        &conditions,
        &headers,
        clips.clip(ClipKey::game_observed(side, chunk)),
    )
    .await
}

fn parse_chunk(chunk: &str) -> Result<u32, Problem> {
    chunk.parse().map_err(|_| {
        let detail = format!("expected the number of a part, from 0, got {chunk:?}");
        Problem::new(ProblemKind::NotFound, detail)
    })
}
