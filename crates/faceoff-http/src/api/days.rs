//! The day's cut, by the organiser.

use super::episodes::checked_episodes;
use crate::{
    app::{App, AppState},
    auth::Organiser,
    extract::OptionalJson,
    problem::{Problem, ProblemKind},
    requests::StartDay,
    views::day::{DayView, NextCut},
};
use axum::{Json, extract::State};
use faceoff_store::{Actor, StoreError};
use jiff::{Timestamp, civil::Date, tz::TimeZone};

/// Starts the day: what each team has active now plays it, nothing else.
///
/// A day has one cut, by the schedule or by this request. A second one starts nothing.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 409, description = "the day has had its cut (“next_cut” says when the next one is), no team has a valid submission, or the season is closed"),
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
    match app.store.start_day(Actor::Organiser, &plan, now).await {
        Ok(created) => tracing::info!(evaluations = created.len(), "the day was started"),
        Err(StoreError::DayHasCut { day, cut_at }) => {
            return Err(had_its_cut(&app, day, cut_at).await?);
        }
        Err(error) => return Err(error.into()),
    }
    let view = DayView::of(&app, now.to_zoned(TimeZone::UTC).date()).await?;
    Ok(Json(view))
}

async fn had_its_cut(app: &AppState, day: Date, cut_at: Timestamp) -> Result<Problem, Problem> {
    let next = NextCut::of(app).await?;
    let detail = format!(
        "{day} had its cut at {}, and a day has one; nothing was started. What the teams have active at the \
         next cut plays the next day: {next}",
        cut_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    );
    let next = serde_json::to_value(next).map_err(Problem::internal)?;
    Ok(Problem::new(ProblemKind::DayHasCut, detail)
        .with("day", day.to_string())
        .with("cut_at", cut_at.to_string())
        .with("next_cut", next))
}
