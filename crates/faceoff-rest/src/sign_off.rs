//! What organisers do after a stage has closed: they start its final evaluation day, and sign off its result, which makes
//! the result final.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::Confirmation,
    views::{day::DayView, stage::StageView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{OptionalJson, PathParam},
    problem::Problem,
    services::stage_results,
    views::{day, stage},
};
use faceoff_types::StageId;

/// Starts a stage's final day: each team's active submission is evaluated on episodes that no other day uses.
///
/// Possible once, after the stage has closed, and only if its standings are `final`.
#[utoipa::path(
    post, path = "/stages/{id}/final", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    responses(
        (status = 200, body = DayView),
        (status = 404),
        (status = 409, description = "its standings are not `final`, it has not closed, its final day or another day of this date has had its cutoff, no team has a valid submission, it is signed off, or the season is closed"),
    )
)]
pub(crate) async fn start_final_day(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
) -> Result<Json<DayView>, Problem> {
    let day = stage_results::start_final_day(&app, organiser.actor(), id).await?;
    day::build(&app, day).await.map(Json)
}

/// Signs off the result of a closed stage, which was provisional. The stage cannot be changed afterwards.
#[utoipa::path(
    post, path = "/stages/{id}/finalise", tag = "organiser", security(("organiser" = [])),
    params(("id" = StageId, Path)),
    request_body(content = Option<Confirmation>, content_type = "application/json"),
    responses(
        (status = 200, body = StageView),
        (status = 404),
        (status = 409, description = "not confirmed with the stage's name (nothing is done), it has not closed, has unfinished evaluations, is blind, lacks its final day, or is already signed off"),
        (status = 422),
    )
)]
pub(crate) async fn finalise_stage(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<StageId>,
    OptionalJson(Confirmation { confirm }): OptionalJson<Confirmation>,
) -> Result<Json<StageView>, Problem> {
    let actor = organiser.actor();
    let signed_off = stage_results::sign_off_stage(&app, actor, id, confirm.as_deref()).await?;
    stage::build(&app, signed_off).await.map(Json)
}
