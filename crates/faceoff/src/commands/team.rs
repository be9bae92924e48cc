//! `faceoff team`: what a member does for their team, and with the organisers.

use super::{
    output::{or_none, print},
    people::{invitation_line, invitation_lines, invited, person_line},
    server::ServerArgs,
    storage::storage_line,
};
use crate::client::Client;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use faceoff_api::{
    requests::{InvitedRole, NewInvitation, TeamChange},
    views::team::TeamView,
};
use faceoff_types::{InvitationId, PersonId, TeamId, TeamName};
use jiff::Timestamp;

/// Shows and changes the team, invites members, asks the organisers.
#[derive(Debug, Args)]
pub struct TeamCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Show what everybody may know of the team
    Show,
    /// Change its name, or what it tells of itself; what is left out stays as it is
    Change {
        /// Another name: 1 to 40 letters, digits, spaces and . _ -
        #[arg(long, value_name = "NAME")]
        rename: Option<TeamName>,
        /// Where it is from; empty: it does not say
        #[arg(long)]
        affiliation: Option<String>,
        /// Its page; empty: none
        #[arg(long, value_name = "URL")]
        link: Option<String>,
        /// Does it play no friendly games that other teams ask for?
        #[arg(long, value_name = "true|false")]
        declines_friendly_games: Option<bool>,
    },
    /// Show how much room its submissions and datasets take
    Storage,
    /// List its members
    Members,
    /// Make a link by which one person joins, and print it, this once
    Invite {
        /// For whom
        note: String,
    },
    /// List the invitations to it
    Invitations,
    /// Take an invitation back
    Uninvite {
        /// The invitation's id
        invitation: InvitationId,
    },
    /// Leave the team for good; without --confirm, say what that would do
    Leave {
        /// Your name
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
    /// Take the team out of all days to come; without --confirm, say what that would do
    Retire {
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Let the team play again after it has retired
    Return,
    /// Ask the organisers
    Ask {
        /// 1 to 2000 characters
        text: String,
    },
    /// Print what the organisers have told and answered
    News,
    /// Print the terms of taking part, or accept them
    Terms {
        /// Accept this version
        #[arg(long, value_name = "VERSION")]
        accept: Option<u32>,
    },
}

impl TeamCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async { act(&self.server.client()?, self.server.json, self.action).await })
    }
}

async fn own_team(client: &Client) -> anyhow::Result<TeamId> {
    let who = client.whoami().await?;
    let team = who.team.map(|team| team.id);
    team.context("the token is no team's: it is an organiser's, for whom there is faceoff admin")
}

async fn own_person(client: &Client) -> anyhow::Result<PersonId> {
    let who = client.whoami().await?;
    match who.person {
        Some(person) => Ok(person.id),
        None => bail!("the token is a program's, not a person's; only people leave"),
    }
}

async fn act(client: &Client, json: bool, action: Action) -> anyhow::Result<()> {
    match action {
        Action::Show => {
            let team = client.team(own_team(client).await?).await?;
            print(json, &team, || team_text(&team))
        }
        Action::Change {
            rename,
            affiliation,
            link,
            declines_friendly_games,
        } => {
            let or_null = |text: String| Some(text).filter(|text| !text.trim().is_empty());
            let change = TeamChange {
                name: rename,
                affiliation: affiliation.map(or_null),
                link: link.map(or_null),
                division: None,
                baseline: None,
                declines_friendly_games,
            };
            let team = client.change_team(own_team(client).await?, &change).await?;
            print(json, &team, || team_text(&team))
        }
        Action::Storage => {
            let storage = client.team_storage(own_team(client).await?).await?;
            print(json, &storage, || storage_line(&storage))
        }
        Action::Members => {
            let people = client.people().await?;
            print(json, &people, || {
                let lines = people.iter().map(person_line).collect();
                or_none(lines, "no member yet: faceoff team invite NOTE")
            })
        }
        Action::Invite { note } => {
            let new = NewInvitation {
                role: InvitedRole::Member,
                team: None,
                person: None,
                note,
                expires_at: None,
            };
            let made = client.invite(&new).await?;
            print(json, &made, || invited(&made))
        }
        Action::Invitations => {
            let invitations = client.invitations().await?;
            print(json, &invitations, || invitation_lines(&invitations))
        }
        Action::Uninvite { invitation } => {
            let revoked = client.revoke_invitation(invitation).await?;
            print(json, &revoked, || invitation_line(&revoked))
        }
        Action::Leave { confirm } => {
            let id = own_person(client).await?;
            let person = client.remove_person(id, confirm).await?;
            print(json, &person, || person_line(&person))
        }
        Action::Retire { confirm } => {
            let team = own_team(client).await?;
            let team = client.retire_team(team, confirm).await?;
            print(json, &team, || team_text(&team))
        }
        Action::Return => {
            let team = client.return_team(own_team(client).await?).await?;
            print(json, &team, || team_text(&team))
        }
        Action::Ask { text } => {
            let question = client.ask(text).await?;
            print(json, &question, || format!("asked ({})", question.id))
        }
        Action::News => news(client, json).await,
        Action::Terms { accept: None } => {
            let terms = client.terms().await?;
            print(json, &terms, || match terms.first() {
                Some(terms) => format!(
                    "version {} since {}\n\n{}",
                    terms.version,
                    shown(terms.since),
                    terms.text
                ),
                None => "this season has no terms".to_owned(),
            })
        }
        Action::Terms {
            accept: Some(version),
        } => {
            let person = client.accept_terms(version).await?;
            print(json, &person, || person_line(&person))
        }
    }
}

async fn news(client: &Client, json: bool) -> anyhow::Result<()> {
    let (announcements, questions) = (client.announcements().await?, client.questions().await?);
    let both = serde_json::json!({ "announcements": announcements, "questions": questions });
    print(json, &both, || {
        let told = announcements
            .iter()
            .map(|told| format!("{}  {}\n{}\n", shown(told.at), told.title, told.text));
        let asked = questions.iter().map(|asked| {
            let answer = asked.answer.as_deref().unwrap_or("no answer yet");
            format!("{}  {}\n→ {answer}\n", shown(asked.at), asked.text)
        });
        or_none(told.chain(asked).collect(), "nothing was told yet")
    })
}

fn shown(at: Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

/// A team in words.
pub(super) fn team_text(team: &TeamView) -> String {
    let mut lines = vec![format!("{} ({})", team.name, team.id)];
    let division = team.division.as_ref().map(ToString::to_string);
    for (what, text) in [
        ("affiliation", team.affiliation.clone()),
        ("link", team.link.clone()),
        ("division", division),
        (
            "baseline",
            team.baseline.then(|| "yes: it is not ranked".to_owned()),
        ),
        ("retired", team.retired_at.map(shown)),
        (
            "disqualified",
            team.disqualified
                .as_ref()
                .map(|ruling| ruling.reason.clone()),
        ),
    ] {
        lines.extend(text.map(|text| format!("{what:<13}{text}")));
    }
    lines.join("\n")
}
