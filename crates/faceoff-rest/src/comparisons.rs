//! Paired comparisons of two evaluations, which ran on the same episodes.

use axum::{Json, extract::State};
use faceoff_api::{requests::ComparisonQuery, views::comparison::ComparisonView};
use faceoff_service::{
    app::App,
    extract::{PathParams, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{comparison, visibility::Visibility},
};
use faceoff_types::EvaluationId;

/// Compares two finished evaluations of the same day, by task and overall: counts of paired episodes, McNemar's exact
/// test, and the difference with its confidence interval.
#[utoipa::path(
    get, path = "/evaluations/{id}/compare/{other}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("other" = EvaluationId, Path), ComparisonQuery),
    responses(
        (status = 200, body = ComparisonView),
        (status = 404),
        (status = 409, description = "the episodes differ (“field” says why), an evaluation is not finished, its stage hides results (blind), or its day is not released"),
    )
)]
pub(crate) async fn compare(
    viewer: Viewer,
    State(app): State<App>,
    PathParams(ids): PathParams<EvaluationId, 2>,
    QueryParams(query): QueryParams<ComparisonQuery>,
) -> Result<Json<ComparisonView>, Problem> {
    let visibility = Visibility::load(&app, viewer).await?;
    comparison::compare(&app, &visibility, ids, query)
        .await
        .map(Json)
}
