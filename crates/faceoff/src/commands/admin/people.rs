//! `faceoff admin people` and `faceoff admin registration`: users and teams of the season. A *division* is a group of teams that
//! a board can rank among themselves.

use super::team_lookup::find_team;
use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        people::{
            changed_access_text, invite, list_invitations, new_invitation, uninvite, user_line,
        },
    },
};
use anyhow::bail;
use clap::Subcommand;
use faceoff_api::{
    requests::{InvitedRole, NewInvitation, SeasonChange},
    views::invitation::RegistrationView,
};
use faceoff_types::{DivisionName, InvitationId, RegistrationId, UserId, UserName};

#[derive(Debug, Subcommand)]
pub(super) enum PeopleAction {
    /// List all users
    List,
    /// Create an invitation link for an organiser
    InviteOrganiser {
        /// Label that identifies the invitation in lists, e.g. the name of the invited person
        note: String,
    },
    /// Create an invitation link for a member of a team
    InviteMember {
        /// The team's name or id
        team: String,
        /// Label that identifies the invitation in lists, e.g. the name of the invited person
        note: String,
    },
    /// Create an invitation link for the first member of a new team, without registration
    InviteTeam {
        /// Label that identifies the invitation in lists, e.g. the name of the invited person
        note: String,
    },
    /// Create a sign-in link for a user who has lost password and tokens
    InviteBack {
        /// The user's name or id
        person: String,
    },
    /// List all invitations
    Invitations,
    /// Revoke an invitation
    Uninvite {
        /// The invitation's id
        invitation: InvitationId,
    },
    /// Change the name with which a user signs in
    Rename {
        /// The user's name or id
        person: String,
        /// The new name
        name: UserName,
    },
    /// Remove a user: their access ends at once; without --confirm, only list the effects
    Remove {
        /// The user's name or id
        person: String,
        /// The user's name, as confirmation
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

#[derive(Debug, Subcommand)]
pub(super) enum RegistrationAction {
    /// List the registrations
    List,
    /// Open registration: anyone can register a team
    Open,
    /// Close registration: teams join by invitation only
    Close,
    /// Approve a registration: the team takes part
    Approve {
        /// The registration's id
        registration: RegistrationId,
    },
    /// Refuse a registration
    Refuse {
        /// The registration's id
        registration: RegistrationId,
        /// Shown to the team under its registration link
        reason: String,
    },
    /// Set the divisions of teams, in display order; without names, there are none
    Divisions {
        /// The names of the divisions
        names: Vec<DivisionName>,
    },
}

async fn find_user(client: &Client, name_or_id: &str) -> anyhow::Result<UserId> {
    if let Ok(id) = name_or_id.parse() {
        return Ok(id);
    }
    let users = client.users().await?;
    match users.iter().find(|user| user.name.as_str() == name_or_id) {
        Some(user) => Ok(user.id),
        None => bail!("there is no user {name_or_id:?}; see faceoff admin people list"),
    }
}

pub(super) async fn people(
    client: &Client,
    json: bool,
    action: PeopleAction,
) -> anyhow::Result<()> {
    match action {
        PeopleAction::List => {
            let users = client.users().await?;
            print_list(
                json,
                &users,
                user_line,
                "no users yet; invite the first with faceoff admin people invite-organiser NOTE",
            )
        }
        PeopleAction::InviteOrganiser { note } => {
            invite(client, json, new_invitation(InvitedRole::Organiser, note)).await
        }
        PeopleAction::InviteMember { team, note } => {
            let invitation = NewInvitation {
                team: Some(find_team(client, &team).await?),
                ..new_invitation(InvitedRole::Member, note)
            };
            invite(client, json, invitation).await
        }
        PeopleAction::InviteTeam { note } => {
            invite(client, json, new_invitation(InvitedRole::Founder, note)).await
        }
        PeopleAction::InviteBack { person } => {
            let invitation = NewInvitation {
                person: Some(find_user(client, &person).await?),
                ..new_invitation(InvitedRole::RestoreAccess, person)
            };
            invite(client, json, invitation).await
        }
        PeopleAction::Invitations => list_invitations(client, json).await,
        PeopleAction::Uninvite { invitation } => uninvite(client, json, invitation).await,
        PeopleAction::Rename { person, name } => {
            let id = find_user(client, &person).await?;
            let renamed = client.rename_user(id, name).await?;
            print(json, &renamed, user_line)
        }
        PeopleAction::Remove { person, confirm } => {
            let id = find_user(client, &person).await?;
            let removed = client.remove_user(id, confirm).await?;
            print(json, &removed, changed_access_text)
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
            return print_list(
                json,
                &registrations,
                registration_line,
                "no team has registered",
            );
        }
        RegistrationAction::Approve { registration } => {
            let approved = client.approve(registration).await?;
            return print(json, &approved, registration_line);
        }
        RegistrationAction::Refuse {
            registration,
            reason,
        } => {
            let refused = client.refuse(registration, reason).await?;
            return print(json, &refused, registration_line);
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
    print(json, &season, |season| {
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
