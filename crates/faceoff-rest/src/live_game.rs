//! A game as it is played, by server-sent events.

use super::told::{LAST_EVENT_ID, told};
use crate::live_reader::{LiveReader, parse_mark};
use axum::{Extension, extract::State, http::HeaderMap, response::IntoResponse};
use faceoff_service::{
    app::App,
    ending::Ending,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::game,
};
use faceoff_types::GameId;
use futures::stream;
use std::sync::Arc;

/// Follows a game: `snapshot` (how it stands), then every `happening` in order, and `position` ten times a second at
/// most, of which only the newest is told; `waiting` while no slot plays it; at the end `over`, and the stream ends.
///
/// The id of a happening is `ATTEMPT.NUMBER`. Who comes again with the header `Last-Event-ID` gets a snapshot and all
/// that happened since; of another attempt everything. Streams end after an hour at most, and when the server ends.
#[utoipa::path(
    get, path = "/games/{id}/live", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(
        ("id" = GameId, Path),
        ("Last-Event-ID" = Option<String>, Header, description = "the id of the last event that came", example = "1.17"),
    ),
    responses(
        (status = 200, body = String, content_type = "text/event-stream"),
        (status = 400, description = "the header is none of this stream's ids"),
        (status = 404),
        (status = 503, description = "as many readers as may be are following games"),
    )
)]
pub(crate) async fn watch_game(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<GameId>,
    ending: Option<Extension<Ending>>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    game::known(&app, viewer, id).await?;
    let seen = headers
        .get(LAST_EVENT_ID)
        .map(|value| parse_mark(value.to_str().unwrap_or_default()))
        .transpose()?;
    let Ok(place) = Arc::clone(&app.watching).try_acquire_owned() else {
        return Err(Problem::new(
            ProblemKind::Busy,
            format!(
                "{} readers follow games, and more may not at a time; try again, or ask GET /api/v1/games/{id} now and then",
                app.config.limits.live_readers
            ),
        ));
    };
    let ending = ending.map(|Extension(ending)| ending);
    let reader = LiveReader::new(app, id, seen, ending, place);
    let batches = stream::unfold(reader, |mut reader| async {
        let batch = reader.next().await?;
        Some((batch, reader))
    });
    Ok(told(batches))
}
