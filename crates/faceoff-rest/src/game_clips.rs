//! The clips that a game's replay is drawn from, 500 control steps each.

use super::{
    clip_answer::send,
    document::{Binary, TagHeader},
    game_files::{game_of, side_of},
};
use axum::{extract::State, http::HeaderMap, response::Response};
use faceoff_replay::Key;
use faceoff_service::{
    app::App,
    conditions::{Conditions, ETag},
    extract::PathParams,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::game_clips::GameClips,
};
use faceoff_types::GameId;

/// The motion of table and robots in a part of a game, as a clip: 500 control steps from 500 × `chunk` on; for everybody
/// who sees the game.
#[utoipa::path(
    get, path = "/games/{id}/motion/{chunk}", tag = "public",
    security((), ("team" = []), ("organiser" = [])),
    params(("id" = GameId, Path), ("chunk" = u32, Path), TagHeader),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 404),
        (status = 409, description = "the game has no result, or no recording; or an older version of the server played it"),
    )
)]
pub(crate) async fn game_motion(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParams(path): PathParams<String, 2>,
) -> Result<Response, Problem> {
    let [id, chunk] = path;
    let (id, chunk) = (game_of(&id)?, number(&chunk)?);
    let clips = GameClips::of(&app, viewer, id).await?;
    let tag = ETag::of("motion", &[&clips.file.key, &chunk.to_string()]);
    send(
        &tag,
        &conditions,
        &headers,
        clips.clip(Key::game_motion(chunk)),
    )
    .await
}

/// What a side was told and commanded in a part of a game, and its times, as a clip; for whoever gets the side's file.
#[utoipa::path(
    get, path = "/games/{id}/sides/{side}/observed/{chunk}", tag = "team",
    security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path), ("side" = u32, Path, minimum = 1, maximum = 2, description = "1: home, 2: away"),
        ("chunk" = u32, Path), TagHeader,
    ),
    responses(
        (status = 200, body = inline(Binary), content_type = "application/octet-stream"),
        (status = 403, description = "another team's, and not public"),
        (status = 404),
        (status = 409, description = "as for the motion"),
    )
)]
pub(crate) async fn game_observed(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParams(path): PathParams<String, 3>,
) -> Result<Response, Problem> {
    let [id, side, chunk] = path;
    let (id, side) = side_of(&[id, side])?;
    let chunk = number(&chunk)?;
    let clips = GameClips::of(&app, viewer, id).await?;
    if !clips.sees[side.index()] {
        return Err(Problem::new(
            viewer.refusal(),
            "what a side was told and commanded is its team's, until the recording is public; the motion is there for \
             everybody",
        ));
    }
    let of = [
        clips.file.key.as_str(),
        &side.number().to_string(),
        &chunk.to_string(),
    ];
    let tag = ETag::of("observed", &of);
    send(
        &tag,
        &conditions,
        &headers,
        clips.clip(Key::game_observed(side, chunk)),
    )
    .await
}

fn number(chunk: &str) -> Result<u32, Problem> {
    chunk.parse().map_err(|_| {
        let detail = format!("parts of games have numbers from 0 on, none is {chunk:?}");
        Problem::new(ProblemKind::NotFound, detail)
    })
}
