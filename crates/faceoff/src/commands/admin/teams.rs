//! `faceoff admin create-team`, `change-team`, `new-token`, `disqualify`, `reinstate`, `retire-team`, `return-team` and `teams`.

use super::find::find_team;
use crate::{
    client::Client,
    commands::{
        output::{or_none, print},
        team::team_text,
    },
};
use anyhow::Context;
use clap::Subcommand;
use faceoff_api::requests::{Decision, TeamChange};
use faceoff_types::{DivisionName, TeamName};

#[derive(Debug, Subcommand)]
pub(super) enum TeamAction {
    /// Create a team and print its token, which is shown this once
    CreateTeam {
        /// 1 to 40 letters, digits, spaces and . _ -
        name: String,
    },
    /// Change a team's name or division, or say whether it is ranked
    ChangeTeam {
        /// The team's name or id
        team: String,
        /// Another name
        #[arg(long, value_name = "NAME")]
        rename: Option<TeamName>,
        /// The division that it is in; empty: none
        #[arg(long)]
        division: Option<String>,
        /// It is a reference agent of yours: boards show it apart, and rank the teams without it
        #[arg(long, conflicts_with = "no_baseline")]
        baseline: bool,
        /// It is ranked as any team
        #[arg(long)]
        no_baseline: bool,
    },
    /// Replace a team's own tokens by one; the old ones are worth nothing from then on
    NewToken {
        /// The team's name or id
        team: String,
    },
    /// Disqualify a team: it neither plays nor is ranked, at once; without --confirm, say what that would do
    Disqualify {
        /// The team's name or id
        team: String,
        /// Shown to everybody
        reason: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Let a disqualified team play and be ranked again
    Reinstate {
        /// The team's name or id
        team: String,
        /// Kept in the log
        reason: String,
    },
    /// Take a team out of all days to come; without --confirm, say what that would do
    RetireTeam {
        /// The team's name or id
        team: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Let a team play again that has retired
    ReturnTeam {
        /// The team's name or id
        team: String,
    },
    /// List the teams
    Teams,
}

pub(super) async fn act(client: &Client, json: bool, action: TeamAction) -> anyhow::Result<()> {
    match action {
        TeamAction::RetireTeam { team, confirm } => {
            let id = find_team(client, &team).await?;
            let team = client.retire_team(id, confirm).await?;
            print(json, &team, || team_text(&team))
        }
        TeamAction::ReturnTeam { team } => {
            let team = client.return_team(find_team(client, &team).await?).await?;
            print(json, &team, || team_text(&team))
        }
        TeamAction::CreateTeam { name } => {
            let created = client.create_team(&name).await?;
            print(json, &created, || {
                format!(
                    "team {} ({})\ntoken {}\nIt is not shown again; give it to the team.",
                    created.team.name, created.team.id, created.token
                )
            })
        }
        TeamAction::ChangeTeam {
            team,
            rename,
            division,
            baseline,
            no_baseline,
        } => {
            let team = find_team(client, &team).await?;
            let division = match division.as_deref().map(str::trim) {
                None => None,
                Some("") => Some(None),
                Some(name) => Some(Some(name.parse::<DivisionName>().context("--division")?)),
            };
            let change = TeamChange {
                name: rename,
                division,
                baseline: (baseline || no_baseline).then_some(baseline),
                ..TeamChange::default()
            };
            let team = client.change_team(team, &change).await?;
            print(json, &team, || team_text(&team))
        }
        TeamAction::NewToken { team } => {
            let team = find_team(client, &team).await?;
            let replaced = client.replace_token(team).await?;
            print(json, &replaced, || {
                format!(
                    "team {} ({})\ntoken {}\nThe old token is worth nothing from now on.",
                    replaced.team.name, replaced.team.id, replaced.token
                )
            })
        }
        TeamAction::Disqualify {
            team,
            reason,
            confirm,
        } => {
            let team = find_team(client, &team).await?;
            let decision = Decision { reason, confirm };
            let team = client.disqualify(team, &decision).await?;
            print(json, &team, || format!("{} is disqualified", team.name))
        }
        TeamAction::Reinstate { team, reason } => {
            let team = find_team(client, &team).await?;
            let team = client.reinstate(team, &reason).await?;
            print(json, &team, || format!("{} is reinstated", team.name))
        }
        TeamAction::Teams => {
            let teams = client.teams().await?;
            print(json, &teams, || {
                let lines: Vec<_> = teams
                    .iter()
                    .map(|team| {
                        let disqualified = match &team.disqualified {
                            Some(ruling) => format!("  disqualified: {}", ruling.reason),
                            None => String::new(),
                        };
                        format!(
                            "{:<40} {}  since {}{disqualified}",
                            team.name,
                            team.id,
                            team.created_at.strftime("%Y-%m-%d")
                        )
                    })
                    .collect();
                or_none(
                    lines,
                    "no team yet; create one with faceoff admin create-team NAME",
                )
            })
        }
    }
}
