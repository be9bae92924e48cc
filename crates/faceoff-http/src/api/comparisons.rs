//! Two evaluations on the same episodes, compared.

use crate::{app::App, extract::PathParams, problem::Problem, views::comparison::ComparisonView};
use axum::{Json, extract::State};
use faceoff_types::EvaluationId;

/// Compares two finished evaluations of the same day: counts of paired episodes, McNemar's exact test
/// and the difference with its interval, by task and overall.
#[utoipa::path(
    get, path = "/evaluations/{id}/compare/{other}", tag = "public",
    params(("id" = EvaluationId, Path), ("other" = EvaluationId, Path)),
    responses(
        (status = 200, body = ComparisonView),
        (status = 404),
        (status = 409, description = "not the same episodes (“field” says what differs), not finished, or of a day that is not released"),
    )
)]
pub(crate) async fn compare(
    State(app): State<App>,
    PathParams(ids): PathParams<EvaluationId, 2>,
) -> Result<Json<ComparisonView>, Problem> {
    ComparisonView::of(&app, ids).await.map(Json)
}
