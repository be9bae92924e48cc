//! Decisions of the organiser's against results and teams, and over the queue. Each takes effect at once, has a reason that everybody may
//! read, and is done only when its request names what it is about, if
//! it cannot be undone.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{Decision, Reason},
    views::{day::DayView, evaluation::EvaluationView, team::TeamView},
};
use faceoff_service::{
    acts::rulings,
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, PathParams},
    problem::Problem,
};
use faceoff_types::{EvaluationId, StageDay, StageId, TeamId};

/// Takes a finished evaluation off the boards, or a failure of the agent off its team's day: it can be read on, counts
/// no more, and may be played again (`rerun`).
#[utoipa::path(
    post, path = "/evaluations/{id}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)), request_body = Decision,
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), under way, it does not count, or its stage is signed off"),
        (status = 422),
    )
)]
pub(crate) async fn void_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    Body(decision): Body<Decision>,
) -> Result<Json<EvaluationView>, Problem> {
    let voided = rulings::void_evaluation(&app, organiser.actor(), id, &decision);
    voided.await.map(Json)
}

/// Voids a whole day: what has ended leaves the boards, what is under way is cancelled, and the day is released.
#[utoipa::path(
    post, path = "/stages/{id}/days/{day}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path), ("day" = Date, Path, example = "2026-03-01")), request_body = Decision,
    responses(
        (status = 200, body = DayView),
        (status = 404),
        (status = 409, description = "not confirmed with the date (nothing is done), nothing of the day counts, or its stage is signed off"),
        (status = 422),
    )
)]
pub(crate) async fn void_day(
    organiser: Organiser,
    State(app): State<App>,
    day: PathParams<String, 2>,
    Body(decision): Body<Decision>,
) -> Result<Json<DayView>, Problem> {
    let PathParams([stage, day]) = day;
    let of: StageDay = format!("{stage}/{day}")
        .parse()
        .map_err(|_| Problem::not_found("day"))?;
    let voided = rulings::void_day(&app, organiser.actor(), of, &decision);
    voided.await.map(Json)
}

/// Holds the queue: nothing is begun, what is begun is played to its end, days start and wait. `GET /season` tells
/// everybody.
#[utoipa::path(
    post, path = "/queue/pause", tag = "organiser", security(("organiser" = [])), request_body = Reason,
    responses((status = 204), (status = 409, description = "it is paused"), (status = 422))
)]
pub(crate) async fn pause_queue(
    organiser: Organiser,
    State(app): State<App>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<StatusCode, Problem> {
    rulings::pause_queue(&app, organiser.actor(), &reason).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Lets a paused queue go on.
#[utoipa::path(
    post, path = "/queue/resume", tag = "organiser", security(("organiser" = [])),
    responses((status = 204), (status = 409, description = "it is not paused"))
)]
pub(crate) async fn resume_queue(
    organiser: Organiser,
    State(app): State<App>,
) -> Result<StatusCode, Problem> {
    rulings::resume_queue(&app, organiser.actor()).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Disqualifies a team at once: what it plays is cancelled, it leaves all boards, and neither uploads nor plays.
#[utoipa::path(
    post, path = "/teams/{id}/disqualify", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Decision,
    responses(
        (status = 200, body = TeamView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), or it is disqualified"),
        (status = 422),
    )
)]
pub(crate) async fn disqualify_team(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(decision): Body<Decision>,
) -> Result<Json<TeamView>, Problem> {
    let team = rulings::disqualify_team(&app, organiser.actor(), id, &decision);
    team.await.map(Json)
}

/// Lets a disqualified team play and be ranked again. What was cancelled can be played again (`rerun`).
#[utoipa::path(
    post, path = "/teams/{id}/reinstate", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Reason,
    responses(
        (status = 200, body = TeamView),
        (status = 404),
        (status = 409, description = "it is not disqualified"),
        (status = 422),
    )
)]
pub(crate) async fn reinstate_team(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<TeamView>, Problem> {
    let team = rulings::reinstate_team(&app, organiser.actor(), id, &reason);
    team.await.map(Json)
}
