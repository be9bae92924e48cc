//! Decisions about a team's turn on a day.

use super::sheet::{EVERYBODY, Sheet, day_page, sentence};
use faceoff_api::{
    requests::{Decision, ExtraTurn},
    views::evaluation::EvaluationView,
};
use faceoff_service::{
    acts::{rulings, turns},
    app::AppState,
    problem::Problem,
    views::{evaluation, sight::Sight},
};
use faceoff_store::Actor;
use faceoff_types::{EvaluationId, StageDay, TeamId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum TurnOrder {
    Void(EvaluationId),
    Cancel(EvaluationId),
    Rerun(EvaluationId),
    Extra(StageDay, TeamId),
}

const ITS_TEAM: &str = "its team reads it";

async fn evaluation(app: &AppState, id: EvaluationId) -> Result<EvaluationView, Problem> {
    evaluation::find(app, &Sight::of_organiser(app).await?, id).await
}

const fn day_of(view: &EvaluationView) -> StageDay {
    StageDay {
        stage: view.stage,
        date: view.day,
    }
}

impl TurnOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "void" => Self::Void(of.parse().ok()?),
            "cancel" => Self::Cancel(of.parse().ok()?),
            "rerun" => Self::Rerun(of.parse().ok()?),
            "extra-turn" => {
                let (day, team) = of.rsplit_once('/')?;
                Self::Extra(day.parse().ok()?, team.parse().ok()?)
            }
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::Void(id) => {
                let view = evaluation(app, id).await?;
                let stake = rulings::at_stake_of_evaluation(app, id, None).await?;
                Ok(Sheet {
                    title: format!("Void the evaluation of {} by {}", view.day, view.team_name),
                    what: sentence(&stake),
                    reason: Some(EVERYBODY),
                    confirm: Some(stake.name),
                    button: "Void the evaluation",
                    is_grave: true,
                    back: day_page(day_of(&view)),
                })
            }
            Self::Cancel(id) => {
                let view = evaluation(app, id).await?;
                Ok(Sheet {
                    title: format!(
                        "Cancel the evaluation of {} by {}",
                        view.day, view.team_name
                    ),
                    what: format!(
                        "It is stopped at {} of {} episodes, and has no score. It can be played again. If it is the last of \
                         its day, the day is released.",
                        view.progress.episodes_done, view.progress.episodes_total
                    ),
                    reason: Some(ITS_TEAM),
                    confirm: None,
                    button: "Cancel the evaluation",
                    is_grave: true,
                    back: day_page(day_of(&view)),
                })
            }
            Self::Rerun(id) => {
                let view = evaluation(app, id).await?;
                Ok(Sheet {
                    title: format!("Play {}’s evaluation of {} again", view.team_name, view.day),
                    what: "The submission that was active at the day’s cut plays the same episodes again, from the \
                           beginning, and the new evaluation counts in the place of this one."
                        .to_owned(),
                    reason: None,
                    confirm: None,
                    button: "Play it again",
                    is_grave: false,
                    back: day_page(day_of(&view)),
                })
            }
            Self::Extra(of, team) => {
                let stake = turns::at_stake_of_turn(app, of, team, None).await?;
                let name = app.store.team(team).await?.name;
                let what = "While the day is under way it plays the day’s episodes; once that is released, episodes of \
                            its own, and its row says so.";
                Ok(Sheet {
                    title: format!("Give {name} an extra turn of {}", of.date),
                    what: match &stake {
                        Some(stake) => format!("{} {what}", sentence(stake)),
                        None => format!(
                            "What {name} has active now plays the day {} once more. {what}",
                            of.date
                        ),
                    },
                    reason: Some(EVERYBODY),
                    is_grave: stake.is_some(),
                    confirm: stake.map(|stake| stake.name),
                    button: "Give the turn",
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
            Self::Void(id) => {
                rulings::void_evaluation(app, actor, id, &decision).await?;
                Ok("voided")
            }
            Self::Cancel(id) => {
                turns::cancel_evaluation(app, actor, id, reason).await?;
                Ok("cancelled")
            }
            Self::Rerun(id) => {
                turns::rerun_evaluation(app, actor, id).await?;
                Ok("rerun")
            }
            Self::Extra(of, team) => {
                let Decision { reason, confirm } = decision;
                let wanted = ExtraTurn {
                    team,
                    reason,
                    confirm,
                };
                turns::extra_turn(app, actor, of, &wanted).await?;
                Ok("extra-turn")
            }
        }
    }
}
