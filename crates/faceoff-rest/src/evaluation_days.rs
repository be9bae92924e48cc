//! Starting evaluation days. A day is all evaluations of one cutoff, the moment at which each team's active submission is
//! fixed.

use axum::{Json, extract::State};
use faceoff_api::{requests::StartDay, views::day::DayView};
use faceoff_service::{
    app::App, auth::Organiser, extract::OptionalJson, problem::Problem, services::evaluations,
    views::day,
};

/// Starts a stage's evaluation day: the cutoff is now, and each team's active submission is evaluated.
///
/// A day has one cutoff, by the schedule or by this request. A second request changes nothing.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cutoff (“next_cutoff” says when the next one is), the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422, description = "several stages are open, and the request names none"),
    )
)]
pub(crate) async fn start_day(
    organiser: Organiser,
    State(app): State<App>,
    OptionalJson(request): OptionalJson<StartDay>,
) -> Result<Json<DayView>, Problem> {
    let day = evaluations::start_day(&app, organiser.actor(), request.stage).await?;
    day::build(&app, day).await.map(Json)
}
