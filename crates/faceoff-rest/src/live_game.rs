//! The stream of a live game: positions, goals and fouls as server-sent events while it is played.

use super::sse::{LAST_EVENT_ID, sse_response, take_permit};
use crate::live_reader::{LiveReader, parse_cursor};
use axum::{Extension, extract::State, http::HeaderMap, response::IntoResponse};
use faceoff_service::{
    app::App, auth::OptionalCaller, extract::PathParam, problem::Problem, shutdown::Shutdown,
    viewer::Viewer, views::game,
};
use faceoff_types::GameId;
use futures::stream;

/// Streams a live game (server-sent events).
///
/// The first event is `snapshot`, the current state. Then follow all `happening` events (goals, fouls and the like) in
/// chronological order, and `position` (of puck and mallets) at most ten times a second, always the newest. While the game
/// waits to be run, `waiting` is sent once. At the end `over` is sent, and the stream ends.
///
/// The id of a `happening` is `ATTEMPT.NUMBER`; a game that is run again has a new attempt. A client that reconnects with
/// the header `Last-Event-ID` gets a snapshot and all happenings since that id; if a new attempt has begun, all happenings
/// of it. A stream ends after at most an hour, when the server shuts down, and when the token becomes invalid.
#[utoipa::path(
    get, path = "/games/{id}/live", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path),
        ("Last-Event-ID" = Option<String>, Header, description = "id of the last received event", example = "1.17"),
    ),
    responses(
        (status = 200, body = String, content_type = "text/event-stream"),
        (status = 400, description = "`Last-Event-ID` is not an event id of this stream"),
        (status = 404),
        (status = 503, description = "the server has as many readers of live games as it may"),
    )
)]
pub(crate) async fn watch_game(
    OptionalCaller(caller): OptionalCaller,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    shutdown: Option<Extension<Shutdown>>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let viewer = caller.as_ref().map_or(Viewer::Visitor, Viewer::new);
    game::find_visible(&app, viewer, id).await?;
    let last_event_id = headers
        .get(LAST_EVENT_ID)
        .map(|value| parse_cursor(value.to_str().unwrap_or_default()))
        .transpose()?;
    let polled = format!("GET /api/v1/games/{id}");
    let permit = take_permit(&app.live_readers, caller.as_ref(), "live games", &polled)?;
    let shutdown = shutdown.map(|Extension(shutdown)| shutdown);
    let requester = caller.map(|caller| caller.requester());
    let reader = LiveReader::new(app, id, requester, last_event_id, shutdown, permit);
    let batches = stream::unfold(reader, |mut reader| async {
        let batch = reader.next().await?;
        Some((batch, reader))
    });
    Ok(sse_response(batches))
}
