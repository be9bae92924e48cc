//! Decisions about an evaluation day: start today's, evaluate a missed one later, or void one.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON, day_page};
use faceoff_api::requests;
use faceoff_service::{
    app::AppState,
    problem::Problem,
    services::{evaluations, organiser_decisions},
    views::capacity,
};
use faceoff_store::Actor;
use faceoff_types::{StageDay, StageId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum DayDecision {
    Start(StageId),
    Missed(StageDay),
    Void(StageDay),
}

impl DayDecision {
    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Void(day) => {
                let effects = organiser_decisions::preview_void_day(app, day, None).await?;
                Ok(DecisionPreview {
                    title: format!("Void the evaluation day {}", day.date),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Void the day",
                    ..DecisionPreview::needing_confirmation(effects, day_page(day))
                })
            }
            Self::Missed(day) => {
                let stage = app.store.stage(day.stage).await?;
                Ok(DecisionPreview {
                    title: format!("Evaluate the missed day {}", day.date),
                    effects: format!(
                        "The active submission of each team will be evaluated for {} in the stage {}, on the episodes of that \
                         date. A day has one cutoff, so you cannot start it a second time.",
                        day.date, stage.name
                    ),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Start the missed day",
                    ..DecisionPreview::new(day_page(day))
                })
            }
            Self::Start(id) => {
                let stage = app.store.stage(id).await?;
                let forecasts = capacity::build(app, id).await?.days;
                let next_forecast = forecasts
                    .into_iter()
                    .rfind(|forecast| !forecast.is_under_way);
                let day = stage.day(app.config.clock.now());
                Ok(DecisionPreview {
                    title: format!("Start the evaluation day {}", day.date),
                    effects: format!(
                        "The active submission of each team will be evaluated for {} in the stage {}. A day has one cutoff, so \
                         you cannot start it a second time. Later uploads will be evaluated on the next evaluation day. {}",
                        day.date,
                        stage.name,
                        next_forecast.map_or_else(String::new, |forecast| forecast.summary)
                    ),
                    button: "Start the day",
                    ..DecisionPreview::new(day_page(day))
                })
            }
        }
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        let reason = request.reason.as_str();
        let (notice, day) = match self {
            Self::Start(id) => (
                "started",
                evaluations::start_day(app, actor, Some(id)).await?,
            ),
            Self::Missed(day) => {
                evaluations::start_missed_day(app, actor, day, reason).await?;
                ("missed", day)
            }
            Self::Void(day) => {
                organiser_decisions::void_day(app, actor, day, &request).await?;
                ("day-voided", day)
            }
        };
        Ok(DecisionOutcome::new(notice, day_page(day)))
    }
}
