//! Evaluations, each the run of all tasks with one team's submission on one day: listing, cancelling and rerunning them.

use crate::paging::{ListQuery, Page, PageQuery, Paged};
use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{paths, requests::Cancellation, views::evaluation::EvaluationView};
use faceoff_service::{
    app::App,
    auth::{Caller, Organiser},
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::evaluations,
    viewer::Viewer,
    views::{evaluation, stage, visibility::Visibility},
};
use faceoff_store::EvaluationFilter;
use faceoff_types::EvaluationId;
use jiff::civil::Date;
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EvaluationsQuery {
    /// An evaluation day, e.g. 2026-11-21. Default: today for organisers, all days for a team.
    day: Option<Date>,
}

/// Lists evaluations: for organisers all of a day, for a team its own.
#[utoipa::path(
    get, path = "/evaluations", tag = "team", security(("team" = []), ("organiser" = [])),
    params(EvaluationsQuery, PageQuery), responses((status = 200, body = Vec<EvaluationView>))
)]
pub(crate) async fn list_evaluations(
    caller: Caller,
    mut page: Page<EvaluationId>,
    State(app): State<App>,
    ListQuery(query): ListQuery<EvaluationsQuery>,
) -> Result<Paged<EvaluationView>, Problem> {
    let visibility = Visibility::load(&app, Viewer::new(&caller)).await?;
    let filter = match (caller.team(), query.day) {
        (None, Some(day)) => EvaluationFilter::Day(day),
        (None, None) => {
            let today = stage::current(&app).await?.day(app.config.clock.now());
            page = page.with_parameter("day", today.date);
            EvaluationFilter::Day(today.date)
        }
        (Some(team), day) => EvaluationFilter::Team(team.id, day),
    };
    let rows = app
        .store
        .evaluations_after(filter, page.after, page.limit + 1);
    let rows = rows.await?.ok_or_else(|| page.unknown_row())?;
    let page = page.page(rows, |evaluation| evaluation.id);
    page.map_all(async |rows| {
        let mut views = evaluation::all(&app, &visibility, rows).await?;
        evaluation::add_queue_positions(&app, &mut views).await?;
        Ok(views)
    })
    .await
}

/// Returns an evaluation: state, progress, score and points.
///
/// Once its day is released it also contains the whole result, or faults and log. A public evaluation needs no token.
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
    let visibility = Visibility::load(&app, viewer).await?;
    let evaluation = visibility.readable(app.store.evaluation(id).await)?;
    evaluation::build(&app, &visibility, evaluation)
        .await
        .map(Json)
}

/// Cancels an evaluation that has not ended. It can be rerun. If it was the last unfinished one of its day, the day is released.
#[utoipa::path(
    post, path = "/evaluations/{id}/cancel", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)), request_body = Cancellation,
    responses(
        (status = 200, body = EvaluationView),
        (status = 404),
        (status = 409, description = "it has ended already"),
    )
)]
pub(crate) async fn cancel_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
    Body(Cancellation { reason }): Body<Cancellation>,
) -> Result<Json<EvaluationView>, Problem> {
    let cancelled = evaluations::cancel_evaluation(&app, organiser.actor(), id, &reason).await?;
    evaluation::for_organiser(&app, cancelled).await.map(Json)
}

/// Reruns an evaluation that was cancelled, voided or failed by a platform fault, with the submission of the day's
/// cutoff on the same episodes. Possible before and after the day's release.
#[utoipa::path(
    post, path = "/evaluations/{id}/rerun", tag = "organiser", security(("organiser" = [])),
    params(("id" = EvaluationId, Path)),
    responses(
        (status = 201, body = EvaluationView, headers(("Location" = String, description = "path of the new evaluation")), description = "the new evaluation"),
        (status = 404),
        (status = 409, description = "it was not cancelled, voided or failed by a platform fault; the team has another evaluation of the day that counts; the stage is signed off; or the season is closed"),
    )
)]
pub(crate) async fn rerun_evaluation(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<EvaluationId>,
) -> Result<impl IntoResponse, Problem> {
    let rerun = evaluations::rerun_evaluation(&app, organiser.actor(), id).await?;
    let view = evaluation::for_organiser(&app, rerun).await?;
    let location = [(header::LOCATION, paths::evaluation(view.id))];
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}
