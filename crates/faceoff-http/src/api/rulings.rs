//! Decisions of the organiser's against results and teams, and over the queue. Each takes effect at once, has a reason that everybody may
//! read, and is done only when its request names what it is about, if
//! it cannot be undone.

use crate::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam, PathParams},
    problem::Problem,
    requests::{Decision, Reason},
    views::{day::DayView, evaluation::EvaluationView, sight::Sight, team::TeamView},
};
use axum::{Json, extract::State, http::StatusCode};
use faceoff_store::EvaluationState;
use faceoff_types::{EvaluationId, StageDay, StageId, TeamId};

/// Longest reason of a decision.
const MAX_REASON_CHARS: usize = 500;

/// A reason without what surrounds it, if it is one.
pub(super) fn checked_reason(reason: &str) -> Result<&str, Problem> {
    let reason = reason.trim();
    let chars = reason.chars().count();
    if !(1..=MAX_REASON_CHARS).contains(&chars) {
        let detail = format!("expected 1 to {MAX_REASON_CHARS} characters, got {chars}");
        return Err(Problem::invalid("reason", detail));
    }
    Ok(reason)
}

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
    let reason = checked_reason(&decision.reason)?;
    let sight = Sight::of_organiser(&app).await?;
    let view = EvaluationView::find(&app, &sight, id).await?;
    let what = format!(
        "the evaluation of {} by {} would leave the boards for good, with the reason {reason:?} for everybody to \
         read; `rerun` can play it again",
        view.day, view.team_name
    );
    Problem::check_confirmed(decision.confirm.as_deref(), view.team_name.as_str(), &what)?;
    let now = app.config.clock.now();
    let voided = app
        .store
        .void_evaluation(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(evaluation = %id, reason, "evaluation voided");
    EvaluationView::of(&app, &sight, voided).await.map(Json)
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
    let reason = checked_reason(&decision.reason)?;
    let (mut ended, mut open) = (0, 0);
    for evaluation in app.store.evaluations_of_day(of).await? {
        match evaluation.state {
            EvaluationState::Finished { .. } | EvaluationState::AgentFailed { .. } => {
                ended += u32::from(evaluation.voided.is_none());
            }
            state => open += u32::from(!state.is_over()),
        }
    }
    let what = format!(
        "{ended} evaluations of {} would leave the boards for good and {open} that are under way be cancelled, with the \
         reason {reason:?} for everybody to read",
        of.date
    );
    Problem::check_confirmed(decision.confirm.as_deref(), &of.date.to_string(), &what)?;
    let now = app.config.clock.now();
    let voided = app
        .store
        .void_day(organiser.actor(), of, reason, now)
        .await?;
    tracing::info!(day = %of, voided, reason, "day voided");
    DayView::of(&app, of).await.map(Json)
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
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    app.store
        .pause_queue(organiser.actor(), reason, now)
        .await?;
    tracing::info!(reason, "queue paused");
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
    let now = app.config.clock.now();
    app.store.resume_queue(organiser.actor(), now).await?;
    tracing::info!("queue resumed");
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
    let reason = checked_reason(&decision.reason)?;
    let team = app.store.team(id).await?;
    let own = app.store.evaluations_of(id).await?;
    let open = own.iter().filter(|evaluation| !evaluation.state.is_over());
    let what = format!(
        "{} would leave all boards, {} of its evaluations that are under way be cancelled, and it would neither upload \
         nor play, with the reason {reason:?} for everybody to read, until it is reinstated",
        team.name,
        open.count()
    );
    Problem::check_confirmed(decision.confirm.as_deref(), team.name.as_str(), &what)?;
    let now = app.config.clock.now();
    let team = app
        .store
        .disqualify_team(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(team = %team.name, %id, reason, "team disqualified");
    Ok(Json(team.into()))
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
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    let team = app
        .store
        .reinstate_team(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(team = %team.name, %id, reason, "team reinstated");
    Ok(Json(team.into()))
}
