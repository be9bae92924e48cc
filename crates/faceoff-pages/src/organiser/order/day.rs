//! Decisions about a day.

use super::sheet::{EVERYBODY, Sheet, day_page, sentence};
use faceoff_api::requests::Decision;
use faceoff_service::{
    acts::{rulings, turns},
    app::AppState,
    problem::Problem,
    views::capacity,
};
use faceoff_store::Actor;
use faceoff_types::{StageDay, StageId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum DayOrder {
    Start(StageId),
    Missed(StageDay),
    Void(StageDay),
}

impl DayOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "start-day" => Self::Start(of.parse().ok()?),
            "missed-day" => Self::Missed(of.parse().ok()?),
            "void-day" => Self::Void(of.parse().ok()?),
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::Void(of) => {
                let stake = rulings::at_stake_of_day(app, of, None).await?;
                Ok(Sheet {
                    title: format!("Void the day {}", of.date),
                    what: sentence(&stake),
                    reason: Some(EVERYBODY),
                    confirm: Some(stake.name),
                    button: "Void the day",
                    is_grave: true,
                    back: day_page(of),
                })
            }
            Self::Missed(of) => {
                let stage = app.store.stage(of.stage).await?;
                Ok(Sheet {
                    title: format!("Play the missed day {}", of.date),
                    what: format!(
                        "What each team has active now plays the day {} of the stage {}, on the episodes of that date. A day \
                         has one cut: it cannot be started a second time.",
                        of.date, stage.name
                    ),
                    reason: Some(EVERYBODY),
                    confirm: None,
                    button: "Play the day",
                    is_grave: false,
                    back: day_page(of),
                })
            }
            Self::Start(id) => {
                let stage = app.store.stage(id).await?;
                let load = capacity::of(app, id).await?.days;
                let next = load.into_iter().rfind(|day| !day.is_under_way);
                let of = stage.day(app.config.clock.now());
                Ok(Sheet {
                    title: format!("Start the day {}", of.date),
                    what: format!(
                        "What each team has active now plays the day {} of the stage {}. A day has one cut: it cannot be \
                         started a second time, and what is uploaded later plays the next one. {}",
                        of.date,
                        stage.name,
                        next.map_or_else(String::new, |next| next.summary)
                    ),
                    reason: None,
                    confirm: None,
                    button: "Start the day",
                    is_grave: false,
                    back: day_page(of),
                })
            }
        }
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        let reason = decision.reason.as_str();
        match self {
            Self::Start(id) => {
                turns::start_day(app, actor, Some(id)).await?;
                Ok("started")
            }
            Self::Missed(of) => {
                turns::start_missed_day(app, actor, of, reason).await?;
                Ok("missed")
            }
            Self::Void(of) => {
                rulings::void_day(app, actor, of, &decision).await?;
                Ok("day-voided")
            }
        }
    }
}
