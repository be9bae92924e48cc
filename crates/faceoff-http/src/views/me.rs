//! What a team may do today.

use super::team::TeamView;
use crate::{app::AppState, problem::Problem};
use faceoff_store::Team;
use faceoff_types::EvaluationId;
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The calling team: who it is and what it may do today.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeView {
    /// Whose token the caller has.
    pub team: TeamView,
    /// Today's.
    pub turn: TurnView,
    /// Largest packed bundle that the server takes, in bytes.
    pub max_bundle_bytes: u64,
}

/// A team's turn of a UTC day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TurnView {
    /// In UTC.
    pub day: Date,
    /// The evaluation that used the turn; null while it is free. One that failed by our fault or was
    /// cancelled gives the turn back.
    pub evaluation: Option<EvaluationId>,
}

impl MeView {
    pub(crate) async fn of(app: &AppState, team: Team) -> Result<Self, Problem> {
        let day = app.config.clock.today();
        let evaluation = app
            .store
            .evaluations_of(team.id)
            .await?
            .into_iter()
            .find(|evaluation| evaluation.day == day && evaluation.state.takes_turn())
            .map(|evaluation| evaluation.id);
        Ok(Self {
            team: team.into(),
            turn: TurnView { day, evaluation },
            max_bundle_bytes: app.config.max_bundle_bytes,
        })
    }
}
