//! The season: its name, rules and the commitment to its secret.

use crate::{App, problem::Problem};
use axum::{Json, extract::State};
use faceoff_types::RULESET;
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
    /// The current UTC day.
    #[schema(value_type = String, format = Date)]
    pub today: civil::Date,
    /// UTC time of the daily evaluation; null when the organiser starts it by hand.
    #[schema(value_type = Option<String>, example = "00:00:00")]
    pub daily_at: Option<civil::Time>,
}

/// The season.
#[utoipa::path(get, path = "/season", tag = "public", responses((status = 200, body = SeasonView)))]
pub(crate) async fn season(State(app): State<App>) -> Result<Json<SeasonView>, Problem> {
    let season = app.season().await?;
    Ok(Json(SeasonView {
        name: season.name,
        ruleset: RULESET.to_owned(),
        commitment: season.commitment,
        created_at: season.created_at,
        today: app.config.clock.today(),
        daily_at: app.config.daily_at,
    }))
}
