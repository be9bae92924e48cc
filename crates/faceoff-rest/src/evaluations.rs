//! Evaluations: following them, stopping them, and playing them again.

use crate::paging::{BesidePage, Page, PageQuery, Paged};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{paths, requests::Cancellation, views::evaluation::EvaluationView};
use faceoff_service::{
    acts::turns,
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    viewer::Viewer,
    views::{evaluation, sight::Sight, stage},
};
use faceoff_store::EvaluationsOf;
use faceoff_types::EvaluationId;
use jiff::civil::Date;
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct DayQuery {
    /// A date in the stages' zones, e.g. 2026-11-21. The organiser gets today's without it, a team all of its own.
    day: Option<Date>,
}

/// The organiser: all evaluations of a day. A team: its own.
#[utoipa::path(
    get, path = "/evaluations", tag = "team", security(("team" = []), ("organiser" = [])),
    params(DayQuery, PageQuery), responses((status = 200, body = Vec<EvaluationView>))
)]
pub(crate) async fn list_evaluations(
    caller: Caller,
    mut page: Page<EvaluationId>,
    State(app): State<App>,
    BesidePage(query): BesidePage<DayQuery>,
) -> Result<Paged<EvaluationView>, Problem> {
    let sight = Sight::of(&app, Viewer::of(&caller)).await?;
    let whose = match (caller.team(), query.day) {
        (None, Some(day)) => EvaluationsOf::Day(day),
        (None, None) => {
            let today = stage::current(&app).await?.day(app.config.clock.now());
            page = page.always_of("day", today.date);
            EvaluationsOf::Day(today.date)
        }
        (Some(team), day) => EvaluationsOf::Team(team.id, day),
    };
    let rows = app
        .store
        .evaluations_after(whose, page.after, page.limit + 1);
    let rows = rows.await?.ok_or_else(|| page.unknown())?;
    let page = page.of_more(rows, |evaluation| evaluation.id);
    page.seen(async |rows| {
        let mut views = evaluation::all(&app, &sight, rows).await?;
        evaluation::place(&app, &mut views).await?;
        Ok(views)
    })
    .await
}

/// One evaluation: state, progress, score and points; once its day is released also the whole result, or the
/// faults with the log. Once it is public, everybody sees it without a token.
#[utoipa::path(
    get, path = "/evaluations/{id}", tag = "team", security((), ("team" = []), ("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    responses((status = 200, body = EvaluationView), (status = 404))
)]
pub(crate) async fn evaluation(
    viewer: Viewer,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<Json<EvaluationView>, Problem> {
    let sight = Sight::of(&app, viewer).await?;
    let evaluation = sight.readable(app.store.evaluation(id).await)?;
    evaluation::of(&app, &sight, evaluation).await.map(Json)
}

/// Stops an evaluation that is not over. It can be played again (`rerun`). If it was the last of its day,
/// that is released.
#[utoipa::path(
    post, path = "/evaluations/{id}/cancel", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)), request_body = Cancellation,
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "it is over already"),
    )
)]
pub(crate) async fn cancel_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    Body(Cancellation { reason }): Body<Cancellation>,
) -> Result<Json<EvaluationView>, Problem> {
    let cancelled = turns::cancel_evaluation(&app, organiser.actor(), id, &reason);
    cancelled.await.map(Json)
}

/// Plays an evaluation again that was cancelled or voided, or failed by our fault: the submission that was active at
/// the day's cut, on the same episodes, before the day's release or after it.
#[utoipa::path(
    post, path = "/evaluations/{id}/rerun", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 201, body = EvaluationView, headers(("Location" = String, description = "where it is, from the server's root")), description = "the evaluation that plays it again"),
        (status = 404),
        (status = 409, description = "it ended otherwise, the team has another evaluation of the day that counts, the stage is signed off, or the season is closed"),
    )
)]
pub(crate) async fn rerun_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<impl IntoResponse, Problem> {
    let view = turns::rerun_evaluation(&app, organiser.actor(), id).await?;
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}
