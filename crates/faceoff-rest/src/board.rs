//! The boards: overall and by task, of each stage, and what they were made of day by day; as JSON and as tables.

use super::{board_csv, document::TagHeader};
use axum::{
    Json,
    extract::State,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_api::{
    requests::{BoardFormat, BoardQuery, HistoryQuery},
    views::{board::BoardView, history::HistoryView},
};
use faceoff_service::{
    app::App,
    conditions::{Conditions, ETag},
    csv::MEDIA_TYPE,
    extract::{PathParam, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{board, history, sight::Sight},
};
use faceoff_types::Task;
use serde::Serialize;

/// The overall board.
#[utoipa::path(
    get, path = "/board", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(BoardQuery, TagHeader),
    responses(
        (status = 200, content((BoardView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "the live board of a frozen stage is the organiser's, and no token came, or one that is worth nothing"),
        (status = 403, description = "the live board of a frozen stage is the organiser's"),
        (status = 404, description = "no such stage, revision or division, or no result of that day"),
    )
)]
pub(crate) async fn board(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Response, Problem> {
    answer(&app, viewer, &conditions, &headers, query, None).await
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("task" = Task, Path), BoardQuery, TagHeader),
    responses(
        (status = 200, content((BoardView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "the live board of a frozen stage is the organiser's, and no token came, or one that is worth nothing"),
        (status = 403, description = "the live board of a frozen stage is the organiser's"),
        (status = 404, description = "no such stage, revision or division, or no result of that day"),
    )
)]
pub(crate) async fn task_board(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Response, Problem> {
    answer(&app, viewer, &conditions, &headers, query, Some(task)).await
}

/// What each team came to on each day, and where it stood by then.
#[utoipa::path(
    get, path = "/board/history", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(HistoryQuery, TagHeader),
    responses(
        (status = 200, content((HistoryView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "what was finished since the freeze is the organiser's, and no token came, or one that is worth nothing"),
        (status = 403, description = "what was finished since the freeze is the organiser's"),
        (status = 404, description = "no such stage, revision or division"),
    )
)]
pub(crate) async fn board_history(
    viewer: Viewer,
    conditions: Conditions,
    headers: HeaderMap,
    State(app): State<App>,
    QueryParams(mut query): QueryParams<HistoryQuery>,
) -> Result<Response, Problem> {
    let change = app.store.newest_change().await?;
    let sight = Sight::of(&app, viewer).await?;
    let stage = board::stage_asked(&app, &sight, (query.stage, query.live)).await?;
    query.stage = Some(stage.id);
    let format = format_of(query.format, &headers);
    let tag = tag(&app, change, viewer, format, &("history", &query))?;
    let Some(mut answer) = conditions.not_modified(&tag) else {
        let history = history::asked(&app, &sight, query).await?;
        return Ok(sent(&tag, format, &history, board_csv::of_history));
    };
    to_be_asked_again(answer.headers_mut());
    Ok(answer)
}

async fn answer(
    app: &App,
    viewer: Viewer,
    conditions: &Conditions,
    headers: &HeaderMap,
    mut query: BoardQuery,
    task: Option<Task>,
) -> Result<Response, Problem> {
    let change = app.store.newest_change().await?;
    let sight = Sight::of(app, viewer).await?;
    let stage = board::stage_asked(app, &sight, (query.stage, query.live)).await?;
    // Which stage is open changes without a change of the season.
    query.stage = Some(stage.id);
    let format = format_of(query.format, headers);
    let tag = tag(app, change, viewer, format, &(task, &query))?;
    let Some(mut answer) = conditions.not_modified(&tag) else {
        let board = board::asked(app, &sight, query, task).await?;
        return Ok(sent(&tag, format, &board, board_csv::of_board));
    };
    to_be_asked_again(answer.headers_mut());
    Ok(answer)
}

/// Of what was asked, by whom, as of the newest change of the season: the newest before anything is read, so that what is
/// changed meanwhile has another tag next time, though it may have been sent already.
fn tag(
    app: &App,
    change: i64,
    viewer: Viewer,
    format: BoardFormat,
    asked: &impl Serialize,
) -> Result<ETag, Problem> {
    // To all others boards are the same.
    let is_organiser = viewer == Viewer::Organiser;
    let asked =
        serde_json::to_string(&(change, is_organiser, format, asked)).map_err(Problem::internal)?;
    Ok(ETag::of("board", &[&app.run.to_string(), &asked]))
}

/// The query decides, then what the client takes: a table only where it takes no JSON.
fn format_of(asked: Option<BoardFormat>, headers: &HeaderMap) -> BoardFormat {
    let accepts = |media_type: &str| {
        let values = headers.get_all(header::ACCEPT).into_iter();
        values
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(','))
            .filter_map(|one| one.split(';').next())
            .any(|one| one.trim().eq_ignore_ascii_case(media_type))
    };
    match asked {
        Some(format) => format,
        None if accepts("text/csv") && !accepts("application/json") => BoardFormat::Csv,
        None => BoardFormat::Json,
    }
}

fn sent<T: Serialize>(
    tag: &ETag,
    format: BoardFormat,
    of: &T,
    csv: impl FnOnce(&T) -> Vec<u8>,
) -> Response {
    let mut answer = match format {
        BoardFormat::Json => Json(of).into_response(),
        BoardFormat::Csv => {
            let media_type = [(header::CONTENT_TYPE, MEDIA_TYPE)];
            (media_type, csv(of)).into_response()
        }
    };
    let headers = answer.headers_mut();
    headers.insert(header::ETAG, tag.header());
    to_be_asked_again(headers);
    answer
}

/// Whoever keeps it asks each time, as who they are, whether it still stands.
fn to_be_asked_again(headers: &mut HeaderMap) {
    let cache = HeaderValue::from_static("private, no-cache");
    headers.insert(header::CACHE_CONTROL, cache);
    let by = HeaderValue::from_static("authorization, cookie, accept");
    headers.insert(header::VARY, by);
}
