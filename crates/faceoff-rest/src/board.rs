//! Boards, which rank the teams of a stage, overall and by task; and their history day by day. As JSON or CSV.

use super::{board_csv, document::IfNoneMatchHeader, downloads::send_tagged};
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
    content_negotiation::wants_csv,
    csv::{CsvFormat, MEDIA_TYPE, Table},
    extract::{PathParam, QueryParams},
    problem::Problem,
    request_preconditions::{ETag, RequestPreconditions},
    viewer::Viewer,
    views::{board, history, visibility::Visibility},
};
use faceoff_types::Task;
use serde::Serialize;

/// Returns the overall board of a stage.
#[utoipa::path(
    get, path = "/board", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(BoardQuery, IfNoneMatchHeader),
    responses(
        (status = 200, content((BoardView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "`live` needs an organiser's token, and the request has none, or the token is invalid"),
        (status = 403, description = "`live` needs an organiser's token"),
        (status = 404, description = "no such stage, revision or division, or the day has no results"),
    )
)]
pub(crate) async fn board(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Response, Problem> {
    respond(&app, viewer, &conditions, &headers, query, None).await
}

/// Returns the board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("task" = Task, Path), BoardQuery, IfNoneMatchHeader),
    responses(
        (status = 200, content((BoardView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "`live` needs an organiser's token, and the request has none, or the token is invalid"),
        (status = 403, description = "`live` needs an organiser's token"),
        (status = 404, description = "no such stage, revision or division, or the day has no results"),
    )
)]
pub(crate) async fn task_board(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Response, Problem> {
    respond(&app, viewer, &conditions, &headers, query, Some(task)).await
}

/// Returns the results and ranks of all teams, day by day.
#[utoipa::path(
    get, path = "/board/history", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(HistoryQuery, IfNoneMatchHeader),
    responses(
        (status = 200, content((HistoryView = "application/json"), (String = "text/csv"))),
        (status = 401, description = "`live` needs an organiser's token, and the request has none, or the token is invalid"),
        (status = 403, description = "`live` needs an organiser's token"),
        (status = 404, description = "no such stage, revision or division"),
    )
)]
pub(crate) async fn board_history(
    viewer: Viewer,
    conditions: RequestPreconditions,
    headers: HeaderMap,
    State(app): State<App>,
    QueryParams(mut query): QueryParams<HistoryQuery>,
) -> Result<Response, Problem> {
    let change = app.store.newest_change().await?;
    let visibility = Visibility::load(&app, viewer).await?;
    let stage = board::requested_stage(&app, &visibility, (query.stage, query.live)).await?;
    query.stage = Some(stage.id);
    let format = choose_format(query.format, &headers);
    let tag = tag(&app, change, viewer, format, &("history", &query))?;
    let history = history::query(&app, &visibility, query);
    let csv = |history: &_| board_csv::history_table(app.config.competition(), history);
    send(&tag, &conditions, format, history, csv).await
}

async fn respond(
    app: &App,
    viewer: Viewer,
    conditions: &RequestPreconditions,
    headers: &HeaderMap,
    mut query: BoardQuery,
    task: Option<Task>,
) -> Result<Response, Problem> {
    let change = app.store.newest_change().await?;
    let visibility = Visibility::load(app, viewer).await?;
    let stage = board::requested_stage(app, &visibility, (query.stage, query.live)).await?;
    // Which stage is open depends on the time, not only on changes of the season, so the tag contains the stage.
    query.stage = Some(stage.id);
    let format = choose_format(query.format, headers);
    let tag = tag(app, change, viewer, format, &(task, &query))?;
    let board = board::query(app, &visibility, query, task);
    let csv = |board: &_| board_csv::board_table(app.config.competition(), board);
    send(&tag, conditions, format, board, csv).await
}

/// The tag (`ETag`) of a response. It is made of the request, the viewer, and the number of the newest change of the season.
/// That number is read before everything else: a change made while the response is built then gives the next response
/// another tag, even if this response already includes the change.
fn tag(
    app: &App,
    change: i64,
    viewer: Viewer,
    format: BoardFormat,
    request: &impl Serialize,
) -> Result<ETag, Problem> {
    // All viewers other than organisers get the same board.
    let is_organiser = viewer == Viewer::Organiser;
    let key = (change, is_organiser, format, request);
    let key = serde_json::to_string(&key).map_err(Problem::internal)?;
    Ok(ETag::new("board", &[&app.process_id.to_string(), &key]))
}

/// The format in the query, else the one that `Accept` prefers: CSV only if the client does not accept JSON.
fn choose_format(requested: Option<BoardFormat>, headers: &HeaderMap) -> BoardFormat {
    match requested {
        Some(format) => format,
        None if wants_csv(headers) => BoardFormat::Csv,
        None => BoardFormat::Json,
    }
}

/// Sends a view in this format, unless the client already has the response with this tag.
async fn send<T: Serialize>(
    tag: &ETag,
    conditions: &RequestPreconditions,
    format: BoardFormat,
    view: impl Future<Output = Result<T, Problem>>,
    table: impl FnOnce(&T) -> Table,
) -> Result<Response, Problem> {
    let response = async {
        let view = view.await?;
        let csv_format = match format {
            BoardFormat::Json => return Ok(Json(view).into_response()),
            BoardFormat::Csv => CsvFormat::Csv,
            BoardFormat::Spreadsheet => CsvFormat::Spreadsheet,
            BoardFormat::SpreadsheetComma => CsvFormat::SpreadsheetComma,
        };
        let media_type = [(header::CONTENT_TYPE, MEDIA_TYPE)];
        Ok((media_type, table(&view).into_bytes(csv_format)).into_response())
    };
    let mut response = send_tagged(tag, conditions, response).await?;
    let request_headers = HeaderValue::from_static("authorization, cookie, accept");
    response.headers_mut().insert(header::VARY, request_headers);
    Ok(response)
}
