//! Decisions about who takes part.

use super::sheet::{EVERYBODY, Sheet, sentence};
use faceoff_api::requests::Decision;
use faceoff_service::{
    acts::{registering, rulings},
    app::AppState,
    problem::Problem,
};
use faceoff_store::Actor;
use faceoff_types::{RegistrationId, TeamId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum TeamOrder {
    Disqualify(TeamId),
    Reinstate(TeamId),
    Approve(RegistrationId),
    Refuse(RegistrationId),
}

const TEAMS: &str = "/organiser/teams";

impl TeamOrder {
    /// The one that a path names.
    pub(super) fn named(kind: &str, of: &str) -> Option<Self> {
        Some(match kind {
            "disqualify" => Self::Disqualify(of.parse().ok()?),
            "reinstate" => Self::Reinstate(of.parse().ok()?),
            "approve" => Self::Approve(of.parse().ok()?),
            "refuse" => Self::Refuse(of.parse().ok()?),
            _ => return None,
        })
    }

    /// What it would do.
    pub(super) async fn sheet(self, app: &AppState) -> Result<Sheet, Problem> {
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
        }
    }
}
