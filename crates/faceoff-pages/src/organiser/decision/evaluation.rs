//! Decisions about an evaluation: void, cancel or repeat it, or grant an extra one.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON, day_page};
use crate::format;
use faceoff_api::{
    requests::{self, NewExtraEvaluation},
    views::evaluation::EvaluationView,
};
use faceoff_service::{
    app::AppState,
    problem::Problem,
    services::{evaluations, organiser_decisions},
    views::{evaluation, visibility::Visibility},
};
use faceoff_store::Actor;
use faceoff_types::{EvaluationId, StageDay, TeamId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum EvaluationDecision {
    Void(EvaluationId),
    Cancel(EvaluationId),
    Rerun(EvaluationId),
    Extra(StageDay, TeamId),
}

/// Value of `reason_readers` for a reason that only the team and organisers see.
const TEAM_REASON: &str = "visible to the team";

async fn evaluation(app: &AppState, id: EvaluationId) -> Result<EvaluationView, Problem> {
    evaluation::find(app, &Visibility::for_organiser(app).await?, id).await
}

const fn day_of(view: &EvaluationView) -> StageDay {
    StageDay {
        stage: view.stage,
        date: view.day,
    }
}

impl EvaluationDecision {
    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Void(id) => {
                let view = evaluation(app, id).await?;
                let effects = organiser_decisions::preview_void_evaluation(app, id, None).await?;
                Ok(DecisionPreview {
                    title: format!("Void the evaluation of {} by {}", view.day, view.team_name),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Void the evaluation",
                    ..DecisionPreview::needing_confirmation(effects, day_page(day_of(&view)))
                })
            }
            Self::Cancel(id) => {
                let view = evaluation(app, id).await?;
                Ok(DecisionPreview {
                    title: format!(
                        "Cancel the evaluation of {} by {}",
                        view.day, view.team_name
                    ),
                    effects: format!(
                        "The evaluation will stop after {} of {} episodes, without a score. It can be repeated. If it is the \
                         last one of the day, the day will be released.",
                        view.progress.episodes_done, view.progress.episodes_total
                    ),
                    reason_readers: Some(TEAM_REASON),
                    button: "Cancel the evaluation",
                    is_grave: true,
                    ..DecisionPreview::new(day_page(day_of(&view)))
                })
            }
            Self::Rerun(id) => {
                let view = evaluation(app, id).await?;
                Ok(DecisionPreview {
                    title: format!("Rerun {}’s evaluation of {}", view.team_name, view.day),
                    effects: "The submission that was active at the cutoff will be evaluated again on the same episodes. The \
                              new evaluation will replace this one."
                        .to_owned(),
                    button: "Rerun the evaluation",
                    ..DecisionPreview::new(day_page(day_of(&view)))
                })
            }
            Self::Extra(day, team) => {
                let effects = evaluations::preview_extra_evaluation(app, day, team, None).await?;
                let name = app.store.team(team).await?.name;
                let episodes = "Until the day is released, it will use the episodes of the day. After that, it will use other \
                                episodes, and the board will say so.";
                Ok(DecisionPreview {
                    title: format!("Give {name} an extra evaluation for {}", day.date),
                    effects: match &effects {
                        Some(effects) => {
                            format!("{} {episodes}", format::sentence(&effects.effect))
                        }
                        None => format!(
                            "The active submission of {name} will be evaluated once more for {}. {episodes}",
                            day.date
                        ),
                    },
                    reason_readers: Some(PUBLIC_REASON),
                    is_grave: effects.is_some(),
                    confirm_name: effects.map(|effects| effects.name),
                    button: "Give the extra evaluation",
                    return_path: day_page(day),
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
        let (notice, evaluation) = match self {
            Self::Void(id) => (
                "voided",
                organiser_decisions::void_evaluation(app, actor, id, &request).await?,
            ),
            Self::Cancel(id) => (
                "cancelled",
                evaluations::cancel_evaluation(app, actor, id, reason).await?,
            ),
            Self::Rerun(id) => (
                "rerun",
                evaluations::rerun_evaluation(app, actor, id).await?,
            ),
            Self::Extra(day, team) => {
                let requests::Decision { reason, confirm } = request;
                let request = NewExtraEvaluation {
                    team,
                    reason,
                    confirm,
                };
                let evaluation =
                    evaluations::grant_extra_evaluation(app, actor, day, &request).await?;
                ("extra-evaluation", evaluation)
            }
        };
        Ok(DecisionOutcome::new(notice, day_page(evaluation.stage_day)))
    }
}
