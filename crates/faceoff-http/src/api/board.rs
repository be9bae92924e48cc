//! The boards: overall and by task.

use crate::{app::App, extract::PathParam, problem::Problem, views::board::BoardView};
use axum::{Json, extract::State};
use faceoff_types::Task;

/// The overall board.
#[utoipa::path(get, path = "/board", tag = "public", responses((status = 200, body = BoardView)))]
pub(crate) async fn board(State(app): State<App>) -> Result<Json<BoardView>, Problem> {
    BoardView::of(&app, None).await.map(Json)
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", params(("task" = Task, Path)),
    responses((status = 200, body = BoardView))
)]
pub(crate) async fn task_board(
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
) -> Result<Json<BoardView>, Problem> {
    BoardView::of(&app, Some(task)).await.map(Json)
}
