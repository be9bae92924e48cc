//! Decisions about a stage and its result.

use super::sheet::{EVERYBODY, Sheet, sentence};
use faceoff_api::requests::Decision;
use faceoff_service::{acts::settling, app::AppState, problem::Problem};
use faceoff_store::Actor;
use faceoff_types::StageId;

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum StageOrder {
    Freeze(StageId),
    Unfreeze(StageId),
    FinalDay(StageId),
    SignOff(StageId),
}

impl StageOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "freeze" => Self::Freeze(of.parse().ok()?),
            "unfreeze" => Self::Unfreeze(of.parse().ok()?),
            "final-day" => Self::FinalDay(of.parse().ok()?),
            "sign-off" => Self::SignOff(of.parse().ok()?),
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
        let (Self::Freeze(id) | Self::Unfreeze(id) | Self::FinalDay(id) | Self::SignOff(id)) = self;
        let name = app.store.stage(id).await?.name;
        let sheet = Sheet {
            title: String::new(),
            what: String::new(),
            reason: None,
            confirm: None,
            button: "",
            is_grave: false,
            back: format!("/organiser/stages/{id}"),
        };
        Ok(match self {
            Self::Freeze(_) => Sheet {
                title: format!("Freeze the boards of {name}"),
                what: "They show what they show now, and say so, until they are unfrozen. Days go on; what is finished later \
                       is on none of them, but for organisers."
                    .to_owned(),
                reason: Some(EVERYBODY),
                button: "Freeze the boards",
                ..sheet
            },
            Self::Unfreeze(_) => Sheet {
                title: format!("Unfreeze the boards of {name}"),
                what: "They show everything again, at once, to everybody.".to_owned(),
                button: "Unfreeze the boards",
                ..sheet
            },
            Self::FinalDay(_) => Sheet {
                title: format!("Start the final day of {name}"),
                what: "What each team has active now plays it, once, on episodes of its own. It makes the stage’s standings."
                    .to_owned(),
                button: "Start the final day",
                ..sheet
            },
            Self::SignOff(_) => {
                let stake = settling::at_stake_of_stage(app, id).await?;
                Sheet {
                    title: format!("Sign off {name}"),
                    what: sentence(&stake),
                    confirm: Some(stake.name),
                    button: "Sign the stage off",
                    is_grave: true,
                    ..sheet
                }
            }
        })
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        let reason = decision.reason.as_str();
        match self {
            Self::Freeze(id) => {
                settling::freeze_boards(app, actor, id, reason).await?;
                Ok("frozen")
            }
            Self::Unfreeze(id) => {
                settling::unfreeze_boards(app, actor, id).await?;
                Ok("unfrozen")
            }
            Self::FinalDay(id) => {
                settling::start_final_day(app, actor, id).await?;
                Ok("final-day")
            }
            Self::SignOff(id) => {
                let confirm = decision.confirm.as_deref();
                settling::finalise_stage(app, actor, id, confirm).await?;
                Ok("signed-off")
            }
        }
    }
}
