//! The boards: overall and by task, of each stage.

use crate::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    requests::BoardQuery,
    viewer::Viewer,
    views::{board::BoardView, sight::Sight},
};
use axum::{Json, extract::State};
use faceoff_types::Task;

/// The overall board.
#[utoipa::path(
    get, path = "/board", tag = "public", params(BoardQuery),
    responses(
        (status = 200, body = BoardView),
        (status = 401, description = "the live board of a frozen stage is the organiser's"),
        (status = 404, description = "no such stage, revision or division"),
    )
)]
pub(crate) async fn board(
    viewer: Viewer,
    State(app): State<App>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Json<BoardView>, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    BoardView::asked(&app, &sight, query, None).await.map(Json)
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", params(("task" = Task, Path), BoardQuery),
    responses(
        (status = 200, body = BoardView),
        (status = 401, description = "the live board of a frozen stage is the organiser's"),
        (status = 404, description = "no such stage, revision or division"),
    )
)]
pub(crate) async fn task_board(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Json<BoardView>, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    BoardView::asked(&app, &sight, query, Some(task))
        .await
        .map(Json)
}
