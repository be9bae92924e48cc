//! `faceoff tournament`: shows tournaments, which are rounds of games between the teams' agents, and withdraws a team from one.

pub(super) mod games;
pub(super) mod lookup;
pub(super) mod text;

use super::{output::print, score::table, server::ServerArgs};
use clap::{Args, Subcommand};
use faceoff_api::requests::Decision;
use faceoff_types::RoundNumber;
use lookup::{TournamentOrNewest, find_tournament};

/// Shows tournaments: teams, games, results, standings and ratings.
#[derive(Debug, Args)]
pub struct TournamentCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the tournaments, the oldest first
    List,
    /// Show a tournament: rules, teams, rounds, standings and next step
    Show(TournamentOrNewest),
    /// List the games: score, goals, fouls, penalty points, winner and reason
    Games {
        #[command(flatten)]
        tournament: TournamentOrNewest,
        /// Only the games of this round
        #[arg(long, value_parser = parse_round)]
        round: Option<RoundNumber>,
    },
    /// Show ratings of the submissions, by results and by goals, and head-to-head records
    Ratings(TournamentOrNewest),
    /// Show how often each team was champion in replays of the schedule with new seeds
    // The command has the name of the API's route: the shares show how certain the result is.
    #[command(name = "certainty")]
    ChampionShares(TournamentOrNewest),
    /// Withdraw your team from a tournament permanently; without --confirm, only list the effects
    Withdraw {
        /// The tournament's name or id
        tournament: String,
        /// Shown publicly
        reason: String,
        /// The team's name, as confirmation
        #[arg(long, value_name = "TEAM")]
        confirm: Option<String>,
    },
}

impl TournamentCommand {
    /// Runs the chosen action.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(self.run_action())
    }

    async fn run_action(self) -> anyhow::Result<()> {
        let client = self.server.client_with_optional_token()?;
        match self.action {
            Action::List => {
                let tournaments = client.tournaments().await?;
                print(
                    self.server.json,
                    tournaments.as_slice(),
                    text::tournament_list,
                )
            }
            Action::Show(tournament) => {
                let id = tournament.find(&client).await?;
                let tournament = client.tournament(id).await?;
                print(self.server.json, &tournament, text::tournament_text)
            }
            Action::Games { tournament, round } => {
                let id = tournament.find(&client).await?;
                let games = client.games(id, round).await?;
                print(self.server.json, games.as_slice(), games::games_table)
            }
            Action::Ratings(tournament) => {
                let id = tournament.find(&client).await?;
                let view = RatingsView {
                    ratings: client.ratings(id).await?,
                    head_to_head: client.head_to_head(id).await?,
                };
                print(self.server.json, &view, |view| {
                    table::ratings_text(&view.ratings, &view.head_to_head)
                })
            }
            Action::ChampionShares(tournament) => {
                let id = tournament.find(&client).await?;
                let shares = client.champion_shares(id).await?;
                print(self.server.json, &shares, text::champion_shares_text)
            }
            Action::Withdraw {
                tournament,
                reason,
                confirm,
            } => {
                let id = find_tournament(&client, &tournament).await?;
                let decision = Decision { reason, confirm };
                let tournament = client.withdraw_from_tournament(id, &decision).await?;
                print(self.server.json, &tournament, text::tournament_text)
            }
        }
    }
}

/// Output of `ratings --json`.
#[derive(Debug, serde::Serialize)]
struct RatingsView {
    ratings: faceoff_scoring::tournament::rating::Ratings,
    head_to_head: Vec<faceoff_scoring::tournament::HeadToHead>,
}

pub(super) fn parse_round(text: &str) -> Result<RoundNumber, String> {
    let number: u32 = text
        .parse()
        .map_err(|_| format!("expected a number, got {text:?}"))?;
    number.try_into().map_err(|error| format!("{error}"))
}
