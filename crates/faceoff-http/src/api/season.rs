//! The season: its name, rules, the commitment to its secret, and its end.

use super::schema::ProblemBody;
use crate::{
    App, AppState,
    auth::Organiser,
    extract::Json as Body,
    problem::{Problem, ProblemKind},
};
use axum::{Json, extract::State};
use faceoff_store::Actor;
use faceoff_types::{RULESET, Seed};
use jiff::{Timestamp, civil};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeasonView {
    /// Its name.
    pub name: String,
    /// The rules that all scores refer to.
    #[schema(example = "airhockey-2023.1")]
    pub ruleset: String,
    /// BLAKE3 of the season secret, 64 hexadecimal digits. All seeds derive from the secret, so that
    /// nobody can change them after the commitment is known.
    pub commitment: String,
    /// When the season began.
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Timestamp,
    /// When it was closed; null while it runs.
    #[schema(value_type = Option<String>, format = DateTime)]
    pub closed_at: Option<Timestamp>,
    /// The season secret, 64 hexadecimal digits; null until the season is closed.
    #[schema(value_type = Option<String>)]
    pub secret: Option<Seed>,
    /// The seed of the season's model mismatch; null until the season is closed.
    #[schema(value_type = Option<String>)]
    pub mismatch_seed: Option<Seed>,
    /// The current UTC day.
    #[schema(value_type = String, format = Date)]
    pub today: civil::Date,
    /// UTC time of the daily evaluation; null when the organiser starts it by hand.
    #[schema(value_type = Option<String>, example = "00:00:00")]
    pub daily_at: Option<civil::Time>,
    /// The days that have evaluations, the newest first.
    pub days: Vec<SeasonDay>,
}

/// A day of the season.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeasonDay {
    /// The UTC day.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// Its finished evaluations.
    pub finished: u32,
    /// The seed of its evaluations; null while somebody must not know it.
    #[schema(value_type = Option<String>)]
    pub seed: Option<Seed>,
}

/// What everybody may know of the season.
pub(crate) async fn view(app: &AppState) -> Result<SeasonView, Problem> {
    let season = app.store.season().await?;
    let days = app.store.days().await?;
    let seeds = app
        .day_seeds(days.iter().map(|(day, _)| *day).collect())
        .await?;
    let revealed = |seed: Seed| season.closed_at.map(|_| seed);
    Ok(SeasonView {
        ruleset: RULESET.to_owned(),
        created_at: season.created_at,
        closed_at: season.closed_at,
        secret: revealed(season.secret),
        mismatch_seed: revealed(season.secret.model_mismatch()),
        today: app.config.clock.today(),
        daily_at: app.config.daily_at,
        days: days
            .into_iter()
            .map(|(day, finished)| SeasonDay {
                day,
                finished,
                seed: seeds.public(season.secret.day(day), day),
            })
            .collect(),
        name: season.name,
        commitment: season.commitment,
    })
}

/// The season.
#[utoipa::path(get, path = "/season", tag = "public", responses((status = 200, body = SeasonView)))]
pub(crate) async fn season(State(app): State<App>) -> Result<Json<SeasonView>, Problem> {
    view(&app).await.map(Json)
}

/// The wish to close the season.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloseSeason {
    /// The season's name, to show that this is no slip: closing cannot be undone.
    pub confirm: String,
}

/// Closes the season for good: its secret becomes public, and nothing more is uploaded or evaluated.
#[utoipa::path(
    post, path = "/season/close", tag = "organiser", security(("organiser" = [])),
    request_body = CloseSeason,
    responses(
        (status = 200, body = SeasonView),
        (status = 409, description = "evaluations are queued or running, or it is closed already", body = ProblemBody, content_type = "application/problem+json"),
        (status = 422, description = "not the season's name", body = ProblemBody, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn close_season(
    _: Organiser,
    State(app): State<App>,
    Body(CloseSeason { confirm }): Body<CloseSeason>,
) -> Result<Json<SeasonView>, Problem> {
    let name = app.store.season().await?.name;
    if confirm != name {
        return Err(Problem::new(
            ProblemKind::InvalidContent,
            format!(
                "confirm: expected the season's name {name:?}, got {confirm:?}; closing cannot be undone"
            ),
        )
        .with("field", "confirm"));
    }
    app.store
        .close_season(Actor::Organiser, app.config.clock.now())
        .await?;
    tracing::info!(season = name, "season closed; its secret is public");
    view(&app).await.map(Json)
}
