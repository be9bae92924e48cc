//! What follows a stage's close: its final day, where it has one, and the signing off of its result.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::Confirmation,
    views::{day::DayView, stage::StageView},
};
use faceoff_service::{
    acts::settling,
    app::App,
    auth::Organiser,
    extract::{OptionalJson, PathParam},
    problem::Problem,
};
use faceoff_types::StageId;

/// Starts a stage's final day, once, after its close: what each team has active now plays it, on episodes of its own.
/// Only of a stage whose standings are `final`.
#[utoipa::path(
    post, path = "/stages/{id}/final", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    responses(
        (status = 200, body = DayView),
        (status = 404),
        (status = 409, description = "its standings are others, it has not closed, its final day or another day of this date has had its cut, no team has a valid submission, it is signed off, or the season is closed"),
    )
)]
pub(crate) async fn start_final_day(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<DayView>, Problem> {
    let started = settling::start_final_day(&app, organiser.actor(), id);
    started.await.map(Json)
}

/// Signs a closed stage's result off: it was provisional, and nothing of the stage changes any more.
#[utoipa::path(
    post, path = "/stages/{id}/finalise", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    request_body(content = Option<Confirmation>, content_type = "application/json"),
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "not confirmed with the stage's name (nothing is done); or it has not closed, evaluations of it are under way, it is blind, its final day is owed, or it is signed off"),
        (status = 422),
    )
)]
pub(crate) async fn finalise_stage(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    OptionalJson(Confirmation { confirm }): OptionalJson<Confirmation>,
) -> Result<Json<StageView>, Problem> {
    let signed = settling::finalise_stage(&app, organiser.actor(), id, confirm.as_deref());
    signed.await.map(Json)
}
