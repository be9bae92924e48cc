//! `faceoff admin people` and `faceoff admin registration`: who takes part.

use super::find::find_team;
use crate::{
    client::Client,
    commands::{
        output::{or_none, print},
        people::{invitation_line, invitation_lines, invited, person_line},
    },
};
use anyhow::bail;
use clap::Subcommand;
use faceoff_api::{
    requests::{InvitedRole, NewInvitation, SeasonChange},
    views::invitation::RegistrationView,
};
use faceoff_types::{DivisionName, InvitationId, PersonId, RegistrationId};

#[derive(Debug, Subcommand)]
pub(super) enum PeopleAction {
    /// List everybody
    List,
    /// Make a link by which one person becomes an organiser
    InviteOrganiser {
        /// For whom
        note: String,
    },
    /// Make a link by which one person becomes a member of a team
    InviteMember {
        /// The team's name or id
        team: String,
        /// For whom
        note: String,
    },
    /// Make a link by which one person brings a new team, without registration
    InviteTeam {
        /// For whom
        note: String,
    },
    /// Make a link for somebody who has lost password and tokens
    InviteBack {
        /// The person's name or id
        person: String,
    },
    /// List all invitations
    Invitations,
    /// Take an invitation back
    Uninvite {
        /// The invitation's id
        invitation: InvitationId,
    },
    /// Let a person do nothing any more, at once; without --confirm, say what that would do
    Remove {
        /// The person's name or id
        person: String,
        /// The person's name
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

#[derive(Debug, Subcommand)]
pub(super) enum RegistrationAction {
    /// List the registrations
    List,
    /// Let anybody register a team
    Open,
    /// Let teams come by invitation only
    Close,
    /// Let a registered team take part
    Approve {
        /// The registration's id
        registration: RegistrationId,
    },
    /// Refuse a registration
    Refuse {
        /// The registration's id
        registration: RegistrationId,
        /// For whoever has the registration's link
        reason: String,
    },
    /// Set the divisions that teams can be in, in their order; none without names
    Divisions {
        /// Their names
        names: Vec<DivisionName>,
    },
}

async fn find_person(client: &Client, wanted: &str) -> anyhow::Result<PersonId> {
    if let Ok(id) = wanted.parse() {
        return Ok(id);
    }
    let people = client.people().await?;
    match people.iter().find(|person| person.name.as_str() == wanted) {
        Some(person) => Ok(person.id),
        None => bail!("nobody is named {wanted:?}; faceoff admin people list shows everybody"),
    }
}

async fn invite(client: &Client, json: bool, new: NewInvitation) -> anyhow::Result<()> {
    let made = client.invite(&new).await?;
    print(json, &made, || invited(&made))
}

const fn new(role: InvitedRole, note: String) -> NewInvitation {
    NewInvitation {
        role,
        team: None,
        person: None,
        note,
        expires_at: None,
    }
}

pub(super) async fn people(
    client: &Client,
    json: bool,
    action: PeopleAction,
) -> anyhow::Result<()> {
    match action {
        PeopleAction::List => {
            let people = client.people().await?;
            print(json, &people, || {
                let lines = people.iter().map(person_line).collect();
                or_none(
                    lines,
                    "nobody yet: faceoff admin people invite-organiser NOTE",
                )
            })
        }
        PeopleAction::InviteOrganiser { note } => {
            invite(client, json, new(InvitedRole::Organiser, note)).await
        }
        PeopleAction::InviteMember { team, note } => {
            let invitation = NewInvitation {
                team: Some(find_team(client, &team).await?),
                ..new(InvitedRole::Member, note)
            };
            invite(client, json, invitation).await
        }
        PeopleAction::InviteTeam { note } => {
            invite(client, json, new(InvitedRole::Founder, note)).await
        }
        PeopleAction::InviteBack { person } => {
            let invitation = NewInvitation {
                person: Some(find_person(client, &person).await?),
                ..new(InvitedRole::Return, person)
            };
            invite(client, json, invitation).await
        }
        PeopleAction::Invitations => {
            let invitations = client.invitations().await?;
            print(json, &invitations, || invitation_lines(&invitations))
        }
        PeopleAction::Uninvite { invitation } => {
            let revoked = client.revoke_invitation(invitation).await?;
            print(json, &revoked, || invitation_line(&revoked))
        }
        PeopleAction::Remove { person, confirm } => {
            let id = find_person(client, &person).await?;
            let removed = client.remove_person(id, confirm).await?;
            print(json, &removed, || person_line(&removed))
        }
    }
}

fn registration_line(registration: &RegistrationView) -> String {
    let reason = match &registration.reason {
        Some(reason) => format!(": {reason}"),
        None => String::new(),
    };
    format!(
        "{}  {:<40} {}, {}{reason}",
        registration.id, registration.team_name, registration.contact, registration.state
    )
}

pub(super) async fn registrations(
    client: &Client,
    json: bool,
    action: RegistrationAction,
) -> anyhow::Result<()> {
    let change = match action {
        RegistrationAction::List => {
            let registrations = client.registrations().await?;
            return print(json, &registrations, || {
                let lines = registrations.iter().map(registration_line).collect();
                or_none(lines, "no team has registered")
            });
        }
        RegistrationAction::Approve { registration } => {
            let approved = client.approve(registration).await?;
            return print(json, &approved, || registration_line(&approved));
        }
        RegistrationAction::Refuse {
            registration,
            reason,
        } => {
            let refused = client.refuse(registration, reason).await?;
            return print(json, &refused, || registration_line(&refused));
        }
        RegistrationAction::Open => SeasonChange {
            takes_registrations: Some(true),
            divisions: None,
        },
        RegistrationAction::Close => SeasonChange {
            takes_registrations: Some(false),
            divisions: None,
        },
        RegistrationAction::Divisions { names } => SeasonChange {
            takes_registrations: None,
            divisions: Some(names),
        },
    };
    let season = client.change_season(&change).await?;
    print(json, &season, || {
        let divisions: Vec<_> = season.divisions.iter().map(ToString::to_string).collect();
        format!(
            "registration is {}; divisions: {}",
            if season.takes_registrations {
                "open"
            } else {
                "closed"
            },
            if divisions.is_empty() {
                "none".to_owned()
            } else {
                divisions.join(", ")
            }
        )
    })
}
