//! The day's cut, by the organiser.

use crate::{
    app::{App, AppState},
    auth::Organiser,
    extract::OptionalJson,
    problem::{Problem, ProblemKind},
    requests::StartDay,
    views::{
        day::{DayView, NextCut},
        stage,
    },
};
use axum::{Json, extract::State};
use faceoff_store::{Stage, StagePhase, StoreError};
use jiff::{Timestamp, civil::Date};

/// Starts a stage's day: what each team has active now plays it, nothing else.
///
/// A day has one cut, by the schedule or by this request. A second one starts nothing.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the day has had its cut (“next_cut” says when the next one is), the stage is not open, no team has a valid submission, or the season is closed"),
        (status = 422, description = "several stages are open, and none is named"),
    )
)]
pub(crate) async fn start_day(
    organiser: Organiser,
    State(app): State<App>,
    OptionalJson(wanted): OptionalJson<StartDay>,
) -> Result<Json<DayView>, Problem> {
    let now = app.config.clock.now();
    let stage = match wanted.stage {
        Some(id) => app.store.stage(id).await?,
        None => the_open_one(&app, now).await?,
    };
    match app.store.start_day(organiser.actor(), stage.id, now).await {
        Ok(created) => tracing::info!(
            stage = %stage.name, evaluations = created.len(), "the day was started"
        ),
        Err(StoreError::DayHasCut { day, cut_at }) => {
            return Err(had_its_cut(&app, &stage, day, cut_at).await?);
        }
        Err(error) => return Err(error.into()),
    }
    DayView::of(&app, stage.day(now)).await.map(Json)
}

/// The stage that is open. Where none is, the nearest, whose refusal tells when it is.
async fn the_open_one(app: &AppState, now: Timestamp) -> Result<Stage, Problem> {
    let mut open = app.store.stages().await?;
    open.retain(|stage| stage.phase(now) == StagePhase::Open);
    if open.len() > 1 {
        let names: Vec<String> = open
            .iter()
            .map(|stage| format!("{} ({})", stage.name, stage.id))
            .collect();
        let detail = format!(
            "several stages are open, so name the one whose day is to start: {}",
            names.join(", ")
        );
        return Err(Problem::invalid("stage", detail));
    }
    stage::current(app).await
}

pub(super) async fn had_its_cut(
    app: &AppState,
    stage: &Stage,
    day: Date,
    cut_at: Timestamp,
) -> Result<Problem, Problem> {
    let next = NextCut::of(app, stage).await?;
    let when = match &next {
        Some(next) => {
            format!("What the teams have active at the next cut plays the next day: {next}")
        }
        None => "The stage has no other day".to_owned(),
    };
    let detail = format!(
        "{day} had its cut at {}, and a day has one; nothing was started. {when}",
        cut_at.strftime("%Y-%m-%d %H:%M:%S UTC")
    );
    let next = serde_json::to_value(next).map_err(Problem::internal)?;
    Ok(Problem::new(ProblemKind::DayHasCut, detail)
        .with("day", day.to_string())
        .with("cut_at", cut_at.to_string())
        .with("next_cut", next))
}
