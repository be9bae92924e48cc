//! `faceoff tournament`: tournaments as everybody sees them, and how a team leaves one.

pub(super) mod find;
pub(super) mod games;
pub(super) mod text;

use super::{output::print, score::table, server::ServerArgs};
use clap::{Args, Subcommand};
use faceoff_api::requests::Decision;
use faceoff_types::RoundNumber;
use find::{find, find_or_newest};

/// Shows tournaments: who is in them, who plays whom, who won and why, how sure that is.
#[derive(Debug, Args)]
pub struct TournamentCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List them, the first one first
    List,
    /// Show one: rules, teams, rounds, tables, and what comes next
    Show {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
    },
    /// List its games: score, goals, fouls, penalty points, who won and why
    Games {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
        /// Of one round alone
        #[arg(long, value_parser = round)]
        round: Option<RoundNumber>,
    },
    /// Show how strong the submissions are, from results and from goals, and the record of each two teams
    Ratings {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Show who was champion how often when the organiser had the schedule played again with fresh seeds
    Certainty {
        /// Its name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Withdraw your team from one for good; without --confirm, say what that would do
    Withdraw {
        /// Its name or id
        tournament: String,
        /// Everybody may read it
        reason: String,
        /// The team's name
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
}

impl TournamentCommand {
    /// Does what was asked.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.act())
    }

    async fn act(self) -> anyhow::Result<()> {
        let client = self.server.anybody()?;
        match self.action {
            Action::List => {
                let tournaments = client.tournaments().await?;
                print(self.server.json, &tournaments, || text::list(&tournaments))
            }
            Action::Show { tournament } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let tournament = client.tournament(id).await?;
                print(self.server.json, &tournament, || text::whole(&tournament))
            }
            Action::Games { tournament, round } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let games = client.games(id, round).await?;
                print(self.server.json, &games, || games::table(&games))
            }
            Action::Ratings { tournament } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let told = Strengths {
                    ratings: client.ratings(id).await?,
                    head_to_head: client.head_to_head(id).await?,
                };
                print(self.server.json, &told, || {
                    table::strengths(&told.ratings, &told.head_to_head)
                })
            }
            Action::Certainty { tournament } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let certainty = client.certainty(id).await?;
                print(self.server.json, &certainty, || text::certainty(&certainty))
            }
            Action::Withdraw {
                tournament,
                reason,
                confirm,
            } => {
                let id = find(&client, &tournament).await?;
                let decision = Decision { reason, confirm };
                let left = client.withdraw_from_tournament(id, &decision).await?;
                print(self.server.json, &left, || text::whole(&left))
            }
        }
    }
}

/// What is printed of ratings with `--json`.
#[derive(Debug, serde::Serialize)]
struct Strengths {
    ratings: faceoff_scoring::tournament::rating::Ratings,
    head_to_head: Vec<faceoff_scoring::tournament::HeadToHead>,
}

/// A round's number, as typed.
pub(super) fn round(text: &str) -> Result<RoundNumber, String> {
    let number: u32 = text
        .parse()
        .map_err(|_| format!("expected a number, got {text:?}"))?;
    number.try_into().map_err(|error| format!("{error}"))
}
