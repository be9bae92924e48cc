//! Decisions about a stage and its result: freeze or unfreeze its boards, start its final day, or sign it off.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON};
use faceoff_api::requests;
use faceoff_service::{app::AppState, problem::Problem, services::stage_results};
use faceoff_store::Actor;
use faceoff_types::StageId;

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum StageDecision {
    Freeze(StageId),
    Unfreeze(StageId),
    FinalDay(StageId),
    SignOff(StageId),
}

impl StageDecision {
    const fn stage(self) -> StageId {
        let (Self::Freeze(id) | Self::Unfreeze(id) | Self::FinalDay(id) | Self::SignOff(id)) = self;
        id
    }

    fn return_path(self) -> String {
        format!("/organiser/stages/{}", self.stage())
    }

    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        let id = self.stage();
        let name = app.store.stage(id).await?.name;
        let preview = DecisionPreview::new(self.return_path());
        Ok(match self {
            Self::Freeze(_) => DecisionPreview {
                title: format!("Freeze the boards of {name}"),
                effects: "The boards will keep their current results, with a notice, until you unfreeze them. Evaluations will \
                          go on; later results will be visible to organisers and, over the API, to their own team only."
                    .to_owned(),
                reason_readers: Some(PUBLIC_REASON),
                button: "Freeze the boards",
                ..preview
            },
            Self::Unfreeze(_) => DecisionPreview {
                title: format!("Unfreeze the boards of {name}"),
                effects: "The boards will show all results to everyone again, at once.".to_owned(),
                button: "Unfreeze the boards",
                ..preview
            },
            Self::FinalDay(_) => DecisionPreview {
                title: format!("Start the final day of {name}"),
                effects: "The active submission of each team will be evaluated once more, on new episodes. Only this day will \
                          count for the board."
                    .to_owned(),
                button: "Start the final day",
                ..preview
            },
            Self::SignOff(_) => {
                let effects = stage_results::preview_sign_off(app, id).await?;
                DecisionPreview {
                    title: format!("Sign off {name}"),
                    button: "Sign off the stage",
                    ..DecisionPreview::needing_confirmation(effects, self.return_path())
                }
            }
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
            Self::Freeze(id) => {
                stage_results::freeze_boards(app, actor, id, reason).await?;
                "frozen"
            }
            Self::Unfreeze(id) => {
                stage_results::unfreeze_boards(app, actor, id).await?;
                "unfrozen"
            }
            Self::FinalDay(id) => {
                stage_results::start_final_day(app, actor, id).await?;
                "final-day"
            }
            Self::SignOff(id) => {
                let confirm = request.confirm.as_deref();
                stage_results::sign_off_stage(app, actor, id, confirm).await?;
                "signed-off"
            }
        };
        Ok(DecisionOutcome::new(notice, self.return_path()))
    }
}
