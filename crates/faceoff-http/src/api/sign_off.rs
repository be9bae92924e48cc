//! What follows a stage's close: its final day, where it has one, and the signing off of its result.

use crate::{
    app::App,
    auth::Organiser,
    extract::{OptionalJson, PathParam},
    problem::{Problem, ProblemKind},
    requests::Confirmation,
    views::{day::DayView, stage::StageView},
};
use axum::{Json, extract::State};
use faceoff_store::StoreError;
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
    let now = app.config.clock.now();
    let stage = app.store.stage(id).await?;
    let started = app.store.start_final_day(organiser.actor(), id, now).await;
    let created = started.map_err(|error| match error {
        StoreError::DayHasCut { day, cut_at } => Problem::new(
            ProblemKind::DayHasCut,
            format!(
                "{day} had its cut at {}, and a date has one; nothing was started. The final day needs a date of its \
                 own: start it when the next one has begun in {}",
                cut_at.strftime("%Y-%m-%d %H:%M:%S UTC"),
                stage.zone
            ),
        )
        .with("day", day.to_string())
        .with("cut_at", cut_at.to_string()),
        error => error.into(),
    })?;
    tracing::info!(stage = %stage.name, evaluations = created.len(), "the final day was started");
    DayView::of(&app, stage.day(now)).await.map(Json)
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
    let now = app.config.clock.now();
    let stage = app.store.check_stage_settled(id, now).await?;
    let name = stage.name.as_str();
    let what = format!(
        "the result of the stage {name:?} would be signed off for good. None of its evaluations could be voided or \
         played again, none of its settings changed, and who is disqualified or reinstated later would not change its \
         boards"
    );
    Problem::check_confirmed(confirm.as_deref(), name, &what)?;
    let done = app.store.finalise_stage(organiser.actor(), id, now).await?;
    tracing::info!(stage = %done.name, %id, "stage signed off");
    StageView::of(&app, done).await.map(Json)
}
