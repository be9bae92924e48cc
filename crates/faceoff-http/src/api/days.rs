//! The day's evaluation of all teams, started by the organiser.

use super::{
    evaluations::{EvaluationView, with_names},
    schema::ProblemBody,
    teams::TeamView,
};
use crate::{
    App,
    auth::Organiser,
    extract::OptionalJson,
    problem::{Problem, ProblemKind},
};
use axum::{Json, extract::State};
use faceoff_store::Actor;
use faceoff_types::{EvaluationId, Profile, TeamId};
use jiff::civil;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use utoipa::ToSchema;

/// Most episodes of a task that one evaluation may have.
const MAX_EPISODES: u32 = 100_000;

/// How today's evaluation shall differ from the configuration. All fields may be left out.
#[derive(Debug, Clone, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartDay {
    /// Episodes of each task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub episodes_per_task: Option<u32>,
    /// The perturbation profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<String>)]
    pub profile: Option<Profile>,
}

/// What starting the day did.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct DayView {
    /// The UTC day.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// Evaluations that this request queued.
    pub created: Vec<EvaluationView>,
    /// Evaluations of the day that existed before.
    pub existing: Vec<EvaluationView>,
    /// Teams without an evaluation today: they have no valid submission, or none that was uploaded
    /// before the day's seed was released.
    pub without_submission: Vec<TeamView>,
}

/// Starts today's evaluation of each team's newest valid submission.
///
/// Asking again is harmless: only teams whose turn is free get an evaluation.
#[utoipa::path(
    post, path = "/days", tag = "organiser", security(("organiser" = [])),
    request_body(content = Option<StartDay>, content_type = "application/json"),
    responses(
        (status = 200, body = DayView),
        (status = 409, description = "the season is closed", body = ProblemBody, content_type = "application/problem+json"),
        (status = 422, body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn start_day(
    _: Organiser,
    State(app): State<App>,
    OptionalJson(wanted): OptionalJson<StartDay>,
) -> Result<Json<DayView>, Problem> {
    let mut plan = app.config.plan.clone();
    if let Some(episodes) = wanted.episodes_per_task {
        if !(1..=MAX_EPISODES).contains(&episodes) {
            return Err(Problem::new(
                ProblemKind::InvalidContent,
                format!("episodes_per_task: expected 1 to {MAX_EPISODES}, got {episodes}"),
            )
            .with("field", "episodes_per_task"));
        }
        plan.episodes_per_task = episodes;
    }
    if let Some(profile) = wanted.profile {
        plan.profile = profile;
    }
    let now = app.config.clock.now();
    let created: BTreeSet<EvaluationId> = app
        .store
        .start_day(Actor::Organiser, &plan, now)
        .await?
        .into_iter()
        .map(|evaluation| evaluation.id)
        .collect();
    let day = now.to_zoned(jiff::tz::TimeZone::UTC).date();
    let all = with_names(&app, app.store.evaluations_on(day).await?).await?;
    let evaluated: BTreeSet<TeamId> = all.iter().map(|evaluation| evaluation.team).collect();
    let (created, existing): (Vec<_>, Vec<_>) = all
        .into_iter()
        .partition(|evaluation| created.contains(&evaluation.id));
    let without_submission = app
        .store
        .teams()
        .await?
        .into_iter()
        .filter(|team| !evaluated.contains(&team.id))
        .map(TeamView::from)
        .collect();
    tracing::info!(%day, created = created.len(), existing = existing.len(), "day started");
    Ok(Json(DayView {
        day,
        created,
        existing,
        without_submission,
    }))
}
