//! The decision that the system clock is right after it was set.

use super::preview::{DecisionOutcome, DecisionPreview};
use faceoff_api::requests;
use faceoff_service::{app::AppState, problem::Problem, services::clock_step};
use faceoff_store::Actor;

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) struct ClockDecision;

/// Page to return to.
const OVERVIEW_PATH: &str = "/organiser";

impl ClockDecision {
    pub(super) fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        Ok(DecisionPreview {
            title: "Accept the system clock".to_owned(),
            button: "Accept the clock",
            ..DecisionPreview::needing_confirmation(
                clock_step::preview_accepted_step(app)?,
                OVERVIEW_PATH,
            )
        })
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        clock_step::accept_step(app, actor, request.confirm.as_deref()).await?;
        Ok(DecisionOutcome::new("clock-accepted", OVERVIEW_PATH))
    }
}
