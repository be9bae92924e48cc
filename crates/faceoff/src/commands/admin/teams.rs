//! `faceoff admin create-team`, `change-team`, `new-token`, `disqualify`, `reinstate`, `retire-team`, `return-team`
//! and `teams`: the teams of the season and their tokens.

use super::team_lookup::find_team;
use crate::{
    client::Client,
    commands::{
        output::{print, print_list},
        team::team_text,
    },
};
use anyhow::Context;
use clap::Subcommand;
use faceoff_api::{
    requests::{Decision, TeamChange},
    views::team::TeamView,
};
use faceoff_types::{DivisionName, TeamName};

#[derive(Debug, Subcommand)]
pub(super) enum TeamAction {
    /// Create a team and print its token, which is shown only once
    CreateTeam {
        /// 1 to 40 letters and digits of any script, spaces and . _ - ' & + ·
        name: String,
    },
    /// Change a team's name or division, or make it a baseline
    ChangeTeam {
        /// The team's name or id
        team: String,
        /// The new name
        #[arg(long, value_name = "NAME")]
        rename: Option<TeamName>,
        /// The team's division; empty: none
        #[arg(long)]
        division: Option<String>,
        /// Make it a baseline: a reference agent that boards show separately and without a rank
        #[arg(long, conflicts_with = "no_baseline")]
        baseline: bool,
        /// Make it a ranked team
        #[arg(long)]
        no_baseline: bool,
    },
    /// Create a new token for a team and revoke its old ones
    NewToken {
        /// The team's name or id
        team: String,
    },
    /// Disqualify a team: it is no longer evaluated or ranked; without --confirm, only list the effects
    Disqualify {
        /// The team's name or id
        team: String,
        /// Shown publicly
        reason: String,
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Reinstate a disqualified team: it is evaluated and ranked again
    Reinstate {
        /// The team's name or id
        team: String,
        /// Recorded in the log
        reason: String,
    },
    /// Retire a team from all future evaluation days; without --confirm, only list the effects
    RetireTeam {
        /// The team's name or id
        team: String,
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
    /// Return a retired team to the competition
    ReturnTeam {
        /// The team's name or id
        team: String,
    },
    /// List the teams
    Teams,
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: TeamAction,
) -> anyhow::Result<()> {
    match action {
        TeamAction::RetireTeam { team, confirm } => {
            let id = find_team(client, &team).await?;
            let team = client.retire_team(id, confirm).await?;
            print(json, &team, team_text)
        }
        TeamAction::ReturnTeam { team } => {
            let team = client.return_team(find_team(client, &team).await?).await?;
            print(json, &team, team_text)
        }
        TeamAction::CreateTeam { name } => {
            let created = client.create_team(&name).await?;
            print(json, &created, |created| {
                format!(
                    "team {} ({})\ntoken {}\nThe token is not shown again; give it to the team.",
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
            print(json, &team, team_text)
        }
        TeamAction::NewToken { team } => {
            let team = find_team(client, &team).await?;
            let replaced = client.replace_token(team).await?;
            print(json, &replaced, |replaced| {
                format!(
                    "team {} ({})\ntoken {}\nThe old tokens are revoked.",
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
            print(json, &team, |team| format!("{} is disqualified", team.name))
        }
        TeamAction::Reinstate { team, reason } => {
            let team = find_team(client, &team).await?;
            let team = client.reinstate(team, reason).await?;
            print(json, &team, |team| format!("{} is reinstated", team.name))
        }
        TeamAction::Teams => {
            let teams = client.teams().await?;
            print_list(
                json,
                &teams,
                team_line,
                "no teams yet; create one with faceoff admin create-team NAME",
            )
        }
    }
}

fn team_line(team: &TeamView) -> String {
    let disqualified = match &team.disqualified {
        Some(decision) => format!("  disqualified: {}", decision.reason),
        None => String::new(),
    };
    format!(
        "{:<40} {}  since {}{disqualified}",
        team.name,
        team.id,
        team.created_at.strftime("%Y-%m-%d")
    )
}
