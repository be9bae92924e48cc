//! The day's evaluation of all teams, started by the organiser.

use super::episodes::checked_episodes;
use crate::{
    app::App, auth::Organiser, extract::OptionalJson, problem::Problem, requests::StartDay,
    views::day::DayView,
};
use axum::{Json, extract::State};
use faceoff_store::Actor;
use jiff::tz::TimeZone;

/// Starts today's evaluation of each team's newest valid submission.
///
/// Asking again is harmless: only teams whose turn is free get an evaluation.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 409, description = "the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn start_day(
    _: Organiser,
    State(app): State<App>,
    OptionalJson(wanted): OptionalJson<StartDay>,
) -> Result<Json<DayView>, Problem> {
    let mut plan = app.config.plan.clone();
    if let Some(episodes) = wanted.episodes_per_task {
        plan.episodes_per_task = checked_episodes(episodes)?;
    }
    plan.profile = wanted.profile.unwrap_or(plan.profile);
    let now = app.config.clock.now();
    let created = app.store.start_day(Actor::Organiser, &plan, now).await?;
    let created = created.iter().map(|evaluation| evaluation.id).collect();
    let view = DayView::of(&app, now.to_zoned(TimeZone::UTC).date(), created).await?;
    let (day, created, existing) = (view.day, view.created.len(), view.existing.len());
    tracing::info!(%day, created, existing, "day started");
    Ok(Json(view))
}
