//! Decisions about the queue of jobs: pause it or resume it.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON};
use crate::format::utc_minute;
use faceoff_api::requests;
use faceoff_service::{
    app::AppState, problem::Problem, services::organiser_decisions, views::decision,
};
use faceoff_store::Actor;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::organiser) enum QueueDecision {
    Pause,
    Resume,
}

/// Page to return to.
const QUEUE_PATH: &str = "/organiser/day";

impl QueueDecision {
    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        let paused = app.store.season().await?.queue_pause.map(decision::view);
        if self == Self::Pause {
            return Ok(DecisionPreview {
                title: "Pause the queue".to_owned(),
                effects: "No new jobs will start; running jobs will finish. Evaluation days will start on time, but their jobs \
                          will wait. The board will show that the queue is paused, with your reason."
                    .to_owned(),
                reason_readers: Some(PUBLIC_REASON),
                button: "Pause the queue",
                ..DecisionPreview::new(QUEUE_PATH)
            });
        }
        let since = paused.map_or_else(
            || "The queue is not paused.".to_owned(),
            |decision| {
                format!(
                    "The queue has been paused since {} ({}).",
                    utc_minute(decision.at),
                    decision.reason
                )
            },
        );
        Ok(DecisionPreview {
            title: "Resume the queue".to_owned(),
            effects: format!("{since} Queued jobs will start at once."),
            button: "Resume the queue",
            ..DecisionPreview::new(QUEUE_PATH)
        })
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let reason = request.reason.as_str();
        let notice = match self {
            Self::Pause => {
                organiser_decisions::pause_queue(app, actor, reason).await?;
                "paused"
            }
            Self::Resume => {
                organiser_decisions::resume_queue(app, actor).await?;
                "resumed"
            }
        };
        Ok(DecisionOutcome::new(notice, QUEUE_PATH))
    }
}
