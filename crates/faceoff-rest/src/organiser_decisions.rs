//! Organisers' decisions about results, teams and the queue. Each takes effect at once and has a public reason. A
//! decision that cannot be undone needs a confirmation with the name of the affected resource.

use axum::{Json, extract::State, http::StatusCode};
use faceoff_api::{
    requests::{Decision, Reason},
    views::{day::DayView, evaluation::EvaluationView, team::TeamView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, StageDayPath},
    problem::Problem,
    services::organiser_decisions,
    views::{day, evaluation, team},
};
use faceoff_types::{EvaluationId, StageId, TeamId};

/// Voids an evaluation that has finished or that agent faults ended: it disappears from the boards and does not count. It stays readable
/// and can be rerun.
#[utoipa::path(
    post, path = "/evaluations/{id}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)), request_body = Decision,
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), it has not ended or does not count, or its stage is signed off"),
        (status = 422),
    )
)]
pub(crate) async fn void_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    Body(decision): Body<Decision>,
) -> Result<Json<EvaluationView>, Problem> {
    let voided =
        organiser_decisions::void_evaluation(&app, organiser.actor(), id, &decision).await?;
    evaluation::for_organiser(&app, voided).await.map(Json)
}

/// Voids a whole day: its evaluations disappear from the boards, unfinished ones are cancelled, and the day is
/// released.
#[utoipa::path(
    post, path = "/stages/{id}/days/{day}/void", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path), ("day" = Date, Path, example = "2026-03-01")), request_body = Decision,
    responses(
        (status = 200, body = DayView),
        (status = 404),
        (status = 409, description = "not confirmed with the date (nothing is done), no evaluation of the day counts, or its stage is signed off"),
        (status = 422),
    )
)]
pub(crate) async fn void_day(
    organiser: Organiser,
    State(app): State<App>,
    StageDayPath(stage_day): StageDayPath,
    Body(decision): Body<Decision>,
) -> Result<Json<DayView>, Problem> {
    organiser_decisions::void_day(&app, organiser.actor(), stage_day, &decision).await?;
    day::build(&app, stage_day).await.map(Json)
}

/// Pauses the queue: no job starts, running jobs continue. Evaluation days still start, but their jobs wait. `GET /season`
/// shows the pause.
#[utoipa::path(
    post, path = "/queue/pause", tag = "organiser", security(("organiser" = [])), request_body = Reason,
    responses((status = 204), (status = 409, description = "the queue is already paused"), (status = 422))
)]
pub(crate) async fn pause_queue(
    organiser: Organiser,
    State(app): State<App>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<StatusCode, Problem> {
    organiser_decisions::pause_queue(&app, organiser.actor(), &reason).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Resumes a paused queue.
#[utoipa::path(
    post, path = "/queue/resume", tag = "organiser", security(("organiser" = [])),
    responses((status = 204), (status = 409, description = "the queue is not paused"))
)]
pub(crate) async fn resume_queue(
    organiser: Organiser,
    State(app): State<App>,
) -> Result<StatusCode, Problem> {
    organiser_decisions::resume_queue(&app, organiser.actor()).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Disqualifies a team at once: its unfinished evaluations are cancelled, it disappears from all boards, and it can
/// neither upload nor be evaluated.
#[utoipa::path(
    post, path = "/teams/{id}/disqualify", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Decision,
    responses(
        (status = 200, body = TeamView),
        (status = 404),
        (status = 409, description = "not confirmed with the team's name (nothing is done), or the team is already disqualified"),
        (status = 422),
    )
)]
pub(crate) async fn disqualify_team(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(decision): Body<Decision>,
) -> Result<Json<TeamView>, Problem> {
    let team = organiser_decisions::disqualify_team(&app, organiser.actor(), id, &decision).await?;
    Ok(Json(team::view(team)))
}

/// Lifts a team's disqualification. Its cancelled evaluations can be rerun.
#[utoipa::path(
    post, path = "/teams/{id}/reinstate", tag = "organiser", security(("organiser" = [])),
    params(("id" = TeamId, Path)), request_body = Reason,
    responses(
        (status = 200, body = TeamView),
        (status = 404),
        (status = 409, description = "the team is not disqualified"),
        (status = 422),
    )
)]
pub(crate) async fn reinstate_team(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TeamId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<TeamView>, Problem> {
    let team = organiser_decisions::reinstate_team(&app, organiser.actor(), id, &reason).await?;
    Ok(Json(team::view(team)))
}
