//! Decisions about teams and registrations: disqualify or reinstate a team, approve or refuse a registration.

use super::preview::{DecisionOutcome, DecisionPreview, PUBLIC_REASON};
use faceoff_api::requests;
use faceoff_service::{
    app::AppState,
    auth::Organiser,
    problem::Problem,
    services::{organiser_decisions, registrations},
};
use faceoff_types::{RegistrationId, TeamId};

#[derive(Debug, Clone, Copy)]
pub(in crate::organiser) enum TeamDecision {
    Disqualify(TeamId),
    Reinstate(TeamId),
    Approve(RegistrationId),
    Refuse(RegistrationId),
}

/// Page to return to.
const TEAMS_PATH: &str = "/organiser/teams";

impl TeamDecision {
    pub(super) async fn preview(self, app: &AppState) -> Result<DecisionPreview, Problem> {
        match self {
            Self::Disqualify(id) => {
                let effects = organiser_decisions::preview_disqualification(app, id, None).await?;
                Ok(DecisionPreview {
                    title: format!("Disqualify {}", effects.name),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Disqualify the team",
                    ..DecisionPreview::needing_confirmation(effects, TEAMS_PATH)
                })
            }
            Self::Reinstate(id) => {
                let team = app.store.team(id).await?;
                Ok(DecisionPreview {
                    title: format!("Reinstate {}", team.name),
                    effects: "The team can upload again, and will be evaluated and ranked. Cancelled evaluations can be repeated."
                        .to_owned(),
                    reason_readers: Some(PUBLIC_REASON),
                    button: "Reinstate the team",
                    ..DecisionPreview::new(TEAMS_PATH)
                })
            }
            Self::Approve(id) | Self::Refuse(id) => {
                let mut registrations = app.store.registrations().await?.into_iter();
                let registration = registrations.find(|registration| registration.id == id);
                let name = registration
                    .ok_or_else(|| Problem::not_found("registration"))?
                    .team_name;
                let approves = matches!(self, Self::Approve(_));
                Ok(DecisionPreview {
                    title: format!(
                        "{} the registration of {name}",
                        if approves { "Approve" } else { "Refuse" }
                    ),
                    effects: if approves {
                        "The team will be created. Its first member can join with the link of the registration within seven days."
                            .to_owned()
                    } else {
                        "The team will not be created. The link of the registration will show your reason."
                            .to_owned()
                    },
                    reason_readers: (!approves).then_some("visible to the registered contact"),
                    button: if approves {
                        "Approve the registration"
                    } else {
                        "Refuse the registration"
                    },
                    // A refusal is irreversible; a team that was approved can be disqualified.
                    is_grave: !approves,
                    ..DecisionPreview::new(TEAMS_PATH)
                })
            }
        }
    }

    pub(super) async fn carry_out(
        self,
        app: &AppState,
        organiser: &Organiser,
        request: requests::Decision,
    ) -> Result<DecisionOutcome, Problem> {
        // The name of the organiser in the event log.
        let actor = organiser.actor();
        let reason = request.reason.as_str();
        let notice = match self {
            Self::Disqualify(id) => {
                organiser_decisions::disqualify_team(app, actor, id, &request).await?;
                "disqualified"
            }
            Self::Reinstate(id) => {
                organiser_decisions::reinstate_team(app, actor, id, reason).await?;
                "reinstated"
            }
            Self::Approve(id) => {
                // User and token, which are checked again in the transaction: the link that it creates needs a valid creator.
                let requester = organiser.requester();
                registrations::approve_registration(app, actor, requester, id).await?;
                "approved"
            }
            Self::Refuse(id) => {
                registrations::refuse_registration(app, actor, id, reason).await?;
                "refused"
            }
        };
        Ok(DecisionOutcome::new(notice, TEAMS_PATH))
    }
}
