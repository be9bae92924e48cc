//! What an organiser may decide: what each decision would do, in words, and how it is carried out.

use crate::{
    acts::{deciding::Stake, registering, rulings, settling, turns},
    app::AppState,
    pages::desk_frame,
    problem::Problem,
    requests::{Decision, ExtraTurn},
    views::{capacity::CapacityView, evaluation::EvaluationView, ruling::RulingView, sight::Sight},
};
use faceoff_store::Actor;
use faceoff_types::{EvaluationId, RegistrationId, StageDay, StageId, TeamId};
use std::{fmt, str::FromStr};

/// A decision, as its page's path names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    StartDay(StageId),
    MissedDay(StageDay),
    VoidDay(StageDay),
    Pause,
    Resume,
    Void(EvaluationId),
    Cancel(EvaluationId),
    Rerun(EvaluationId),
    ExtraTurn(StageDay, TeamId),
    Disqualify(TeamId),
    Reinstate(TeamId),
    Approve(RegistrationId),
    Refuse(RegistrationId),
    Freeze(StageId),
    Unfreeze(StageId),
    FinalDay(StageId),
    SignOff(StageId),
}

/// A path that names no decision.
#[derive(Debug)]
pub(super) struct NoOrder;

impl fmt::Display for NoOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("there is no such decision; go back to the desk, and choose one there")
    }
}

impl FromStr for Order {
    type Err = NoOrder;

    fn from_str(path: &str) -> Result<Self, NoOrder> {
        fn id<T: FromStr>(text: &str) -> Result<T, NoOrder> {
            text.parse().map_err(|_| NoOrder)
        }
        let (kind, of) = path.split_once('/').unwrap_or((path, ""));
        Ok(match kind {
            "start-day" => Self::StartDay(id(of)?),
            "missed-day" => Self::MissedDay(id(of)?),
            "void-day" => Self::VoidDay(id(of)?),
            "pause" if of.is_empty() => Self::Pause,
            "resume" if of.is_empty() => Self::Resume,
            "void" => Self::Void(id(of)?),
            "cancel" => Self::Cancel(id(of)?),
            "rerun" => Self::Rerun(id(of)?),
            "extra-turn" => {
                let (day, team) = of.rsplit_once('/').ok_or(NoOrder)?;
                Self::ExtraTurn(id(day)?, id(team)?)
            }
            "disqualify" => Self::Disqualify(id(of)?),
            "reinstate" => Self::Reinstate(id(of)?),
            "approve" => Self::Approve(id(of)?),
            "refuse" => Self::Refuse(id(of)?),
            "freeze" => Self::Freeze(id(of)?),
            "unfreeze" => Self::Unfreeze(id(of)?),
            "final-day" => Self::FinalDay(id(of)?),
            "sign-off" => Self::SignOff(id(of)?),
            _ => return Err(NoOrder),
        })
    }
}

/// A decision as its page tells it before it is taken.
pub(super) struct Sheet {
    pub(super) title: String,
    pub(super) what: String,
    /// Who reads the reason, where one is wanted.
    pub(super) reason: Option<&'static str>,
    /// The name that confirms it, where one is wanted.
    pub(super) confirm: Option<String>,
    pub(super) button: &'static str,
    /// It cannot be undone, or hits a team at once.
    pub(super) is_grave: bool,
    /// Where one came from, and goes back to.
    pub(super) back: String,
}

const EVERYBODY: &str = "everybody may read it";
const ITS_TEAM: &str = "its team reads it";
const TEAMS: &str = "/organiser/teams";

fn day_page(of: StageDay) -> String {
    format!("/organiser/day?stage={}&day={}", of.stage, of.date)
}

fn stage_page(id: StageId) -> String {
    format!("/organiser/stages/{id}")
}

/// A stake's words, as a sentence.
fn sentence(stake: &Stake) -> String {
    let mut chars = stake.what.chars();
    let first: String = chars
        .next()
        .into_iter()
        .flat_map(char::to_uppercase)
        .collect();
    format!("{first}{}.", chars.as_str())
}

async fn evaluation(app: &AppState, id: EvaluationId) -> Result<EvaluationView, Problem> {
    EvaluationView::find(app, &Sight::of_organiser(app).await?, id).await
}

const fn day_of(view: &EvaluationView) -> StageDay {
    StageDay {
        stage: view.stage,
        date: view.day,
    }
}

impl Order {
    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::StartDay(_) | Self::MissedDay(_) | Self::VoidDay(_) => self.of_day(app).await,
            Self::Pause | Self::Resume => self.of_queue(app).await,
            Self::Void(_) | Self::Cancel(_) | Self::Rerun(_) | Self::ExtraTurn(..) => {
                self.of_turn(app).await
            }
            Self::Disqualify(_) | Self::Reinstate(_) | Self::Approve(_) | Self::Refuse(_) => {
                self.of_team(app).await
            }
            Self::Freeze(_) | Self::Unfreeze(_) | Self::FinalDay(_) | Self::SignOff(_) => {
                self.of_stage(app).await
            }
        }
    }

    async fn of_day(self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::VoidDay(of) => {
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
            Self::MissedDay(of) => {
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
            Self::StartDay(id) => {
                let stage = app.store.stage(id).await?;
                let load = CapacityView::of(app, id).await?.days;
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
            _ => Err(Problem::internal("no decision about a day")),
        }
    }

    async fn of_queue(self, app: &AppState) -> Result<Sheet, Problem> {
        let paused = app.store.season().await?.paused.map(RulingView::from);
        let back = "/organiser/day".to_owned();
        if self == Self::Pause {
            return Ok(Sheet {
                title: "Pause the queue".to_owned(),
                what: "Nothing new is begun. What is begun is played to its end; days start, and wait. Every page says \
                       that the queue is paused, and why."
                    .to_owned(),
                reason: Some(EVERYBODY),
                confirm: None,
                button: "Pause",
                is_grave: false,
                back,
            });
        }
        let since = paused.map_or_else(
            || "The queue is not paused.".to_owned(),
            |ruling| {
                format!(
                    "The queue is paused since {} ({}).",
                    desk_frame::at(ruling.at),
                    ruling.reason
                )
            },
        );
        Ok(Sheet {
            title: "Let the queue go on".to_owned(),
            what: format!("{since} What waits is begun at once."),
            reason: None,
            confirm: None,
            button: "Go on",
            is_grave: false,
            back,
        })
    }

    async fn of_turn(self, app: &AppState) -> Result<Sheet, Problem> {
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
            Self::ExtraTurn(of, team) => {
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
            _ => Err(Problem::internal("no decision about a turn")),
        }
    }

    async fn of_team(self, app: &AppState) -> Result<Sheet, Problem> {
        match self {
            Self::Disqualify(id) => {
                let stake = rulings::at_stake_of_team(app, id, None).await?;
                Ok(Sheet {
                    title: format!("Disqualify {}", stake.name),
                    what: sentence(&stake),
                    reason: Some(EVERYBODY),
                    confirm: Some(stake.name),
                    button: "Disqualify the team",
                    is_grave: true,
                    back: TEAMS.to_owned(),
                })
            }
            Self::Reinstate(id) => {
                let team = app.store.team(id).await?;
                Ok(Sheet {
                    title: format!("Reinstate {}", team.name),
                    what: "It uploads, plays and is ranked again. What was cancelled can be played again.".to_owned(),
                    reason: Some(EVERYBODY),
                    confirm: None,
                    button: "Reinstate the team",
                    is_grave: false,
                    back: TEAMS.to_owned(),
                })
            }
            Self::Approve(id) | Self::Refuse(id) => {
                let mut all = app.store.registrations().await?.into_iter();
                let found = all.find(|registration| registration.id == id);
                let name = found
                    .ok_or_else(|| Problem::not_found("registration"))?
                    .team_name;
                let approves = matches!(self, Self::Approve(_));
                Ok(Sheet {
                    title: format!("{} {name}", if approves { "Approve" } else { "Refuse" }),
                    what: if approves {
                        "The team takes part: the link of its registration is its first member’s, for seven days from now."
                            .to_owned()
                    } else {
                        "The team does not take part; the link of its registration says so, with the reason.".to_owned()
                    },
                    reason: (!approves).then_some("whoever registered the team reads it"),
                    confirm: None,
                    button: if approves { "Approve" } else { "Refuse" },
                    is_grave: !approves,
                    back: TEAMS.to_owned(),
                })
            }
            _ => Err(Problem::internal("no decision about a team")),
        }
    }

    async fn of_stage(self, app: &AppState) -> Result<Sheet, Problem> {
        let (Self::Freeze(id) | Self::Unfreeze(id) | Self::FinalDay(id) | Self::SignOff(id)) = self
        else {
            return Err(Problem::internal("no decision about a stage"));
        };
        let name = app.store.stage(id).await?.name;
        let sheet = Sheet {
            title: String::new(),
            what: String::new(),
            reason: None,
            confirm: None,
            button: "",
            is_grave: false,
            back: stage_page(id),
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
            _ => {
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

    /// Does it, as the API's requests do, and says by which words that is told.
    pub(super) async fn carry_out(
        self,
        app: &AppState,
        actor: Actor,
        decision: Decision,
    ) -> Result<&'static str, Problem> {
        let reason = decision.reason.as_str();
        match self {
            Self::StartDay(id) => {
                turns::start_day(app, actor, Some(id)).await?;
                Ok("started")
            }
            Self::MissedDay(of) => {
                turns::start_missed_day(app, actor, of, reason).await?;
                Ok("missed")
            }
            Self::VoidDay(of) => {
                rulings::void_day(app, actor, of, &decision).await?;
                Ok("day-voided")
            }
            Self::Pause => {
                rulings::pause_queue(app, actor, reason).await?;
                Ok("paused")
            }
            Self::Resume => {
                rulings::resume_queue(app, actor).await?;
                Ok("resumed")
            }
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
            Self::ExtraTurn(of, team) => {
                let Decision { reason, confirm } = decision;
                let wanted = ExtraTurn {
                    team,
                    reason,
                    confirm,
                };
                turns::extra_turn(app, actor, of, &wanted).await?;
                Ok("extra-turn")
            }
            Self::Disqualify(id) => {
                rulings::disqualify_team(app, actor, id, &decision).await?;
                Ok("disqualified")
            }
            Self::Reinstate(id) => {
                rulings::reinstate_team(app, actor, id, reason).await?;
                Ok("reinstated")
            }
            Self::Approve(id) => {
                registering::approve_registration(app, actor, id).await?;
                Ok("approved")
            }
            Self::Refuse(id) => {
                registering::refuse_registration(app, actor, id, reason).await?;
                Ok("refused")
            }
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
