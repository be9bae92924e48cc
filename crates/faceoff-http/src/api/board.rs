//! The boards: overall and by task.

use crate::{
    app::{App, AppState},
    extract::{PathParam, QueryParams},
    problem::Problem,
    views::board::BoardView,
};
use axum::{Json, extract::State};
use faceoff_types::{Ruleset, Task};
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct RulesetQuery {
    /// The newest with results without it. No board mixes two.
    #[param(value_type = Option<String>, example = "airhockey-2023.1")]
    ruleset: Option<Ruleset>,
}

impl RulesetQuery {
    async fn board(self, app: &AppState, task: Option<Task>) -> Result<Json<BoardView>, Problem> {
        let board = match self.ruleset {
            Some(ruleset) => BoardView::of(app, ruleset, task).await,
            None => BoardView::newest(app, task).await,
        };
        board.map(Json)
    }
}

/// The overall board.
#[utoipa::path(
    get, path = "/board", tag = "public", params(RulesetQuery),
    responses((status = 200, body = BoardView))
)]
pub(crate) async fn board(
    State(app): State<App>,
    QueryParams(query): QueryParams<RulesetQuery>,
) -> Result<Json<BoardView>, Problem> {
    query.board(&app, None).await
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public", params(("task" = Task, Path), RulesetQuery),
    responses((status = 200, body = BoardView))
)]
pub(crate) async fn task_board(
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
    QueryParams(query): QueryParams<RulesetQuery>,
) -> Result<Json<BoardView>, Problem> {
    query.board(&app, Some(task)).await
}
