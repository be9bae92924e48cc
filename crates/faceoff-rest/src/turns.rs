//! Turns beside the schedule's: a day that was missed, and one more evaluation for one team.

use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{
    paths,
    requests::{ExtraTurn, MissedDay},
    views::{day::DayView, evaluation::EvaluationView},
};
use faceoff_service::{
    acts::turns,
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, PathParams},
    problem::Problem,
};
use faceoff_types::{StageDay, StageId};

/// Plays a day that was missed: a date of the stage that has passed without a cut. What each team has active now
/// plays it, on the episodes of that date.
#[utoipa::path(
    post, path = "/stages/{id}/days", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)), request_body = MissedDay,
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cut, the date has not passed or is none of the stage's, the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_missed_day(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    Body(MissedDay { day, reason }): Body<MissedDay>,
) -> Result<Json<DayView>, Problem> {
    let of = StageDay {
        stage: id,
        date: day,
    };
    let started = turns::start_missed_day(&app, organiser.actor(), of, &reason);
    started.await.map(Json)
}

/// Gives one team one more evaluation of a day that has had its cut, with what it has active now.
///
/// While the day is under way it plays the day's episodes. Once that is released it plays episodes of its own, since
/// the day's are public; its row says so, and is not compared episode by episode.
#[utoipa::path(
    post, path = "/stages/{id}/days/{day}/extra-turn", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path), ("day" = Date, Path, example = "2026-03-01")), request_body = ExtraTurn,
    responses(
        (status = 201, body = EvaluationView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 403, description = "the team is disqualified"),
        (status = 404),
        (status = 409, description = "a result that counts would be replaced, and the team's name does not confirm it (nothing is done); one is under way; the team has nothing active; the stage is not open, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn extra_turn(
    organiser: Organiser,
    State(app): State<App>,
    day: PathParams<String, 2>,
    Body(wanted): Body<ExtraTurn>,
) -> Result<impl IntoResponse, Problem> {
    let PathParams([stage, day]) = day;
    let of: StageDay = format!("{stage}/{day}")
        .parse()
        .map_err(|_| Problem::not_found("day"))?;
    let view = turns::extra_turn(&app, organiser.actor(), of, &wanted).await?;
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}
