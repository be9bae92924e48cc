//! Evaluations outside the schedule: missed evaluation days, and extra evaluations of one team. The *cutoff* of a day is the
//! moment at which each team's active submission is fixed.

use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{
    paths,
    requests::{MissedDay, NewExtraEvaluation},
    views::{day::DayView, evaluation::EvaluationView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, StageDayPath},
    problem::Problem,
    services::evaluations,
    views::{day, evaluation},
};
use faceoff_types::{StageDay, StageId};

/// Starts a missed day: a past date of the stage without a cutoff. Each team's active submission is evaluated on the
/// episodes of that date.
#[utoipa::path(
    post, path = "/stages/{id}/days", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = MissedDay,
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cutoff, the date is not in the past or not within the stage, the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_missed_day(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(MissedDay { day, reason }): Body<MissedDay>,
) -> Result<Json<DayView>, Problem> {
    let stage_day = StageDay {
        stage: id,
        date: day,
    };
    evaluations::start_missed_day(&app, organiser.actor(), stage_day, &reason).await?;
    day::build(&app, stage_day).await.map(Json)
}

/// Grants a team one more evaluation for a day whose cutoff has passed, with its currently active submission.
///
/// Before the day's release it runs on the day's episodes. After the release, when these are public, it runs on
/// other episodes; its board row says so, and it cannot be compared episode by episode.
#[utoipa::path(
    post, path = "/stages/{id}/days/{day}/extra-evaluation", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path), ("day" = Date, Path, example = "2026-03-01")), request_body = NewExtraEvaluation,
    responses(
        (status = 201, body = EvaluationView, headers(("Location" = String, description = "path of the new evaluation"))),
        (status = 403, description = "the team is disqualified"),
        (status = 404),
        (status = 409, description = "a result that counts would be replaced, and this is not confirmed with the team's name (nothing is done); an evaluation is running; the team has no active submission; the stage is not open; or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn grant_extra_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    StageDayPath(stage_day): StageDayPath,
    Body(request): Body<NewExtraEvaluation>,
) -> Result<impl IntoResponse, Problem> {
    let extra =
        evaluations::grant_extra_evaluation(&app, organiser.actor(), stage_day, &request).await?;
    let view = evaluation::for_organiser(&app, extra).await?;
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}
