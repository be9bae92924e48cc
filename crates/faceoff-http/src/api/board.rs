//! The boards: overall and by task, of each stage.

use crate::{
    app::App,
    auth::PerhapsOrganiser,
    extract::{PathParam, QueryParams},
    problem::Problem,
    requests::BoardQuery,
    views::board::BoardView,
};
use axum::{Json, extract::State};
use faceoff_types::Task;

/// The overall board.
#[utoipa::path(
    get, path = "/board", tag = "public", params(BoardQuery),
    responses(
        (status = 200, body = BoardView),
        (status = 401, description = "the live board of a frozen stage is the organiser's"),
        (status = 404),
    )
)]
pub(crate) async fn board(
    State(app): State<App>,
    caller: PerhapsOrganiser,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Json<BoardView>, Problem> {
    caller.check_if(query.live)?;
    BoardView::asked(&app, query, None).await.map(Json)
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", params(("task" = Task, Path), BoardQuery),
    responses(
        (status = 200, body = BoardView),
        (status = 401, description = "the live board of a frozen stage is the organiser's"),
        (status = 404),
    )
)]
pub(crate) async fn task_board(
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
    caller: PerhapsOrganiser,
    QueryParams(query): QueryParams<BoardQuery>,
) -> Result<Json<BoardView>, Problem> {
    caller.check_if(query.live)?;
    BoardView::asked(&app, query, Some(task)).await.map(Json)
}
