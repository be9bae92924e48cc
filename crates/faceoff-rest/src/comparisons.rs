//! Two evaluations on the same episodes, compared.

use axum::{Json, extract::State};
use faceoff_api::{requests::ComparisonQuery, views::comparison::ComparisonView};
use faceoff_service::{
    app::App,
    extract::{PathParams, QueryParams},
    problem::Problem,
    viewer::Viewer,
    views::{comparison, sight::Sight},
};
use faceoff_types::EvaluationId;

/// Compares two finished evaluations of the same day: counts of paired episodes, McNemar's exact test
/// and the difference with its interval, by task and overall.
#[utoipa::path(
    get, path = "/evaluations/{id}/compare/{other}", tag = "public", security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path), ("other" = EvaluationId, Path), ComparisonQuery),
    responses(
        (status = 200, body = ComparisonView),
        (status = 404),
        (status = 409, description = "not the same episodes (“field” says what differs), not finished, of a blind stage, or of a day that is not released"),
    )
)]
pub(crate) async fn compare(
    viewer: Viewer,
    State(app): State<App>,
    PathParams(ids): PathParams<EvaluationId, 2>,
    QueryParams(query): QueryParams<ComparisonQuery>,
) -> Result<Json<ComparisonView>, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    comparison::of(&app, &sight, ids, query).await.map(Json)
}
