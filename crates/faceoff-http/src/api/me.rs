//! The calling team: who it is and what it may do today.

use super::teams::TeamView;
use crate::{App, auth::TeamCaller, problem::Problem};
use axum::{Json, extract::State};
use faceoff_types::EvaluationId;
use jiff::civil;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The calling team.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeView {
    /// The team.
    pub team: TeamView,
    /// Today's turn.
    pub turn: TurnView,
    /// Largest packed bundle that the server takes, in bytes.
    pub max_bundle_bytes: u64,
}

/// A team's turn of a UTC day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TurnView {
    /// The day.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// The evaluation that used the turn; null while it is free. One that failed by our fault or was
    /// cancelled gives the turn back.
    #[schema(value_type = Option<String>, format = Uuid)]
    pub evaluation: Option<EvaluationId>,
}

/// The calling team and its turn of today.
#[utoipa::path(
    get, path = "/me", tag = "team", security(("team" = [])), responses((status = 200, body = MeView))
)]
pub(crate) async fn me(
    TeamCaller(team): TeamCaller,
    State(app): State<App>,
) -> Result<Json<MeView>, Problem> {
    let day = app.config.clock.today();
    let evaluation = app
        .store
        .evaluations_of(team.id)
        .await?
        .into_iter()
        .find(|evaluation| evaluation.day == day && evaluation.state.takes_turn())
        .map(|evaluation| evaluation.id);
    Ok(Json(MeView {
        team: team.into(),
        turn: TurnView { day, evaluation },
        max_bundle_bytes: app.config.max_bundle_bytes,
    }))
}
