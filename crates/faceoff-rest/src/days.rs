//! The day's cut, by the organiser.

use axum::{Json, extract::State};
use faceoff_api::{requests::StartDay, views::day::DayView};
use faceoff_service::{
    acts::turns, app::App, auth::Organiser, extract::OptionalJson, problem::Problem,
};

/// Starts a stage's day: what each team has active now plays it, nothing else.
///
/// A day has one cut, by the schedule or by this request. A second one starts nothing.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cut (“next_cut” says when the next one is), the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422, description = "several stages are open, and none is named"),
    )
)]
pub(crate) async fn start_day(
    organiser: Organiser,
    State(app): State<App>,
    OptionalJson(wanted): OptionalJson<StartDay>,
) -> Result<Json<DayView>, Problem> {
    let started = turns::start_day(&app, organiser.actor(), wanted.stage);
    started.await.map(Json)
}
