//! `faceoff team`: shows and manages the member's own team.

use super::{
    output::{lines_or, print, print_list, time_text},
    people::{changed_access_text, invite, list_invitations, new_invitation, uninvite, user_line},
    server::ServerArgs,
    storage::storage_line,
};
use crate::client::Client;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{InvitedRole, TeamChange},
    views::team::TeamView,
};
use faceoff_types::{InvitationId, TeamId, TeamName, UserId, UserName};

/// Shows and changes the team, invites members, and asks the organisers.
#[derive(Debug, Args)]
pub struct TeamCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Show the team's public profile
    Show,
    /// Change the team's name or profile; options that are left out do not change
    Change {
        /// The new name: 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
        #[arg(long, value_name = "NAME")]
        rename: Option<TeamName>,
        /// The team's affiliation; empty: none
        #[arg(long)]
        affiliation: Option<String>,
        /// The team's web page; empty: none
        #[arg(long, value_name = "URL")]
        link: Option<String>,
        /// Decline friendly games that other teams request
        #[arg(long, value_name = "true|false")]
        declines_friendly_games: Option<bool>,
    },
    /// Show the disk usage of the team's submissions and datasets
    Storage,
    /// List the team's members
    Members,
    /// Change the name with which you sign in
    RenameMe {
        /// Your new name
        name: UserName,
    },
    /// Create an invitation link for one member and print it; it is shown only once
    Invite {
        /// Label that identifies the invitation in lists, e.g. the name of the invited person
        note: String,
    },
    /// List the team's invitations
    Invitations,
    /// Revoke an invitation
    Uninvite {
        /// The invitation's id
        invitation: InvitationId,
    },
    /// Leave the team permanently; without --confirm, only list the effects
    Leave {
        /// Your name, as confirmation
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Retire the team from all future evaluation days; without --confirm, only list the effects
    Retire {
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Return to the competition after the team has retired
    Return,
    /// Ask the organisers a question
    Ask {
        /// 1 to 2000 characters
        text: String,
    },
    /// Print the organisers' announcements and answers
    News,
    /// Print the terms of participation, or accept them
    Terms {
        /// Accept this version
        #[arg(long, value_name = "VERSION")]
        accept: Option<u32>,
    },
}

impl TeamCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            run_action(&self.server.client()?, self.server.json, self.action).await
        })
    }
}

async fn own_team_id(client: &Client) -> anyhow::Result<TeamId> {
    let caller = client.whoami().await?;
    let team = caller.team.map(|team| team.id);
    team.context("the token does not belong to a team; organisers use faceoff admin")
}

async fn own_user_id(client: &Client) -> anyhow::Result<UserId> {
    let caller = client.whoami().await?;
    match caller.person {
        Some(person) => Ok(person.id),
        None => {
            bail!("the token does not belong to a user: sign in with your name (faceoff login)")
        }
    }
}

async fn run_action(client: &Client, json: bool, action: Action) -> anyhow::Result<()> {
    match action {
        Action::Show => {
            let team = client.team(own_team_id(client).await?).await?;
            print(json, &team, team_text)
        }
        Action::Change {
            rename,
            affiliation,
            link,
            declines_friendly_games,
        } => {
            let none_if_empty = |text: String| Some(text).filter(|text| !text.trim().is_empty());
            let change = TeamChange {
                name: rename,
                affiliation: affiliation.map(none_if_empty),
                link: link.map(none_if_empty),
                division: None,
                baseline: None,
                declines_friendly_games,
            };
            let team = client
                .change_team(own_team_id(client).await?, &change)
                .await?;
            print(json, &team, team_text)
        }
        Action::Storage => {
            let storage = client.team_storage(own_team_id(client).await?).await?;
            print(json, &storage, storage_line)
        }
        Action::Members => {
            let users = client.users().await?;
            print_list(
                json,
                &users,
                user_line,
                "no members yet; invite one with faceoff team invite NOTE",
            )
        }
        Action::RenameMe { name } => {
            let renamed = client.rename_user(own_user_id(client).await?, name).await?;
            print(json, &renamed, user_line)
        }
        Action::Invite { note } => {
            let invitation = new_invitation(InvitedRole::Member, note);
            invite(client, json, invitation).await
        }
        Action::Invitations => list_invitations(client, json).await,
        Action::Uninvite { invitation } => uninvite(client, json, invitation).await,
        Action::Leave { confirm } => {
            let id = own_user_id(client).await?;
            let user = client.remove_user(id, confirm).await?;
            print(json, &user, changed_access_text)
        }
        Action::Retire { confirm } => {
            let team = own_team_id(client).await?;
            let team = client.retire_team(team, confirm).await?;
            print(json, &team, team_text)
        }
        Action::Return => {
            let team = client.return_team(own_team_id(client).await?).await?;
            print(json, &team, team_text)
        }
        Action::Ask { text } => {
            let question = client.ask(text).await?;
            print(json, &question, |question| {
                format!("asked ({})", question.id)
            })
        }
        Action::News => news(client, json).await,
        Action::Terms { accept: None } => {
            let terms = client.terms().await?;
            print(json, &terms, |terms| match terms.first() {
                Some(terms) => format!(
                    "version {} since {}\n\n{}",
                    terms.version,
                    time_text(terms.since),
                    terms.text
                ),
                None => "this season has no terms".to_owned(),
            })
        }
        Action::Terms {
            accept: Some(version),
        } => {
            let user = client.accept_terms(version).await?;
            print(json, &user, user_line)
        }
    }
}

async fn news(client: &Client, json: bool) -> anyhow::Result<()> {
    let (announcements, questions) = (client.announcements().await?, client.questions().await?);
    let news = serde_json::json!({ "announcements": announcements, "questions": questions });
    print(json, &news, |_| {
        let announcements = announcements.iter().map(|announcement| {
            format!(
                "{}  {}\n{}\n",
                time_text(announcement.at),
                announcement.title,
                announcement.text
            )
        });
        let answers = questions.iter().map(|question| {
            let answer = question.answer.as_deref().unwrap_or("no answer yet");
            format!(
                "{}  {}\n→ {answer}\n",
                time_text(question.at),
                question.text
            )
        });
        lines_or(
            announcements.chain(answers).collect(),
            "no announcements or questions yet",
        )
    })
}

/// A team's profile as text.
pub(super) fn team_text(team: &TeamView) -> String {
    let mut lines = vec![format!("{} ({})", team.name, team.id)];
    let division = team.division.as_ref().map(ToString::to_string);
    for (label, text) in [
        ("affiliation", team.affiliation.clone()),
        ("link", team.link.clone()),
        ("division", division),
        (
            "baseline",
            team.baseline.then(|| "yes, not ranked".to_owned()),
        ),
        ("retired", team.retired_at.map(time_text)),
        (
            "disqualified",
            team.disqualified
                .as_ref()
                .map(|decision| decision.reason.clone()),
        ),
    ] {
        lines.extend(text.map(|text| format!("{label:<13}{text}")));
    }
    lines.join("\n")
}
