//! `faceoff game`: single games of a tournament, and the games of a team that do not count: friendly games against another team
//! and test games against the baseline. A game has two *sides*: 1 (home) and 2 (away).

mod watch;

use super::{
    output::{print, print_download},
    server::ServerArgs,
    tournament::{games, lookup::TournamentOrNewest},
};
use crate::client::Client;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use faceoff_api::views::game::GameView;
use faceoff_types::{GameId, Side, TeamName};
use std::path::PathBuf;

/// Requests friendly and test games, and shows, watches and downloads games.
#[derive(Debug, Args)]
pub struct GameCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Request a test game of your active submission against the baseline, before or between rounds; it does not count
    Test(TournamentOrNewest),
    /// Request a friendly game of your active submission against another team's, before or between rounds; it does
    /// not count
    Friendly {
        /// The other team's name
        opponent: TeamName,
        #[command(flatten)]
        tournament: TournamentOrNewest,
    },
    /// List your friendly and test games, the newest first (for games that count: faceoff tournament games)
    List(TournamentOrNewest),
    /// Show a game with its state and result
    Show {
        /// The game's id
        game: GameId,
    },
    /// Watch a game live: goals, fouls and faults, until it is over
    Watch {
        /// The game's id
        game: GameId,
    },
    /// Download your side's dataset of a finished game
    Download {
        /// The game's id
        game: GameId,
        /// The file to write; an existing file is replaced
        file: PathBuf,
        /// The dataset of this side, if it is public: 1 (home) or 2 (away)
        #[arg(long, value_parser = parse_side, conflicts_with = "both")]
        side: Option<Side>,
        /// The recording of both sides with the game's seed, for faceoff verify, if it is public
        #[arg(long)]
        both: bool,
    },
    /// Print the beginning and the end of your agent's log, with its faults
    Log {
        /// The game's id
        game: GameId,
        /// For organisers: the side, 1 (home) or 2 (away)
        #[arg(long, value_parser = parse_side)]
        side: Option<Side>,
    },
    /// Cancel a pending friendly or test game that your team has requested
    Cancel {
        /// The game's id
        game: GameId,
    },
}

pub(super) fn parse_side(text: &str) -> Result<Side, String> {
    let side = Side::BOTH
        .into_iter()
        .find(|side| side.number().to_string() == text);
    side.ok_or_else(|| format!("expected 1 (home) or 2 (away), got {text:?}"))
}

impl GameCommand {
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
            Action::Test(tournament) => {
                let id = tournament.find(&client).await?;
                let requested = client.request_test_games(id, None).await?;
                print(self.server.json, &requested, games::test_games_text)
            }
            Action::Friendly {
                opponent,
                tournament,
            } => {
                let id = tournament.find(&client).await?;
                let game = client.request_friendly_game(id, opponent).await?;
                print(self.server.json, &game, games::game_text)
            }
            Action::List(tournament) => {
                let id = tournament.find(&client).await?;
                let games = client.uncounted_games(id).await?;
                print(self.server.json, games.as_slice(), games::games_table)
            }
            Action::Show { game } => {
                let game = client.game(game).await?;
                print(self.server.json, &game, games::game_text)
            }
            Action::Watch { game } => watch::watch(&client, self.server.json, game).await,
            Action::Download {
                game,
                file,
                side,
                both,
            } => {
                print_download(self.server.json, async |bar| {
                    if both {
                        return client.download_recording(game, &file, bar).await;
                    }
                    let side = own_side(&client, &client.game(game).await?, side).await?;
                    client.download_side(game, side, &file, bar).await
                })
                .await
            }
            Action::Log { game, side } => {
                let side = own_side(&client, &client.game(game).await?, side).await?;
                print!("{}", client.game_log(game, side).await?);
                Ok(())
            }
            Action::Cancel { game } => {
                let game = client.cancel_game(game).await?;
                print(self.server.json, &game, games::game_text)
            }
        }
    }
}

/// The given side, or else the side of the token's team.
pub(super) async fn own_side(
    client: &Client,
    game: &GameView,
    side: Option<Side>,
) -> anyhow::Result<Side> {
    if let Some(side) = side {
        return Ok(side);
    }
    let caller = client
        .whoami()
        .await
        .context("the side is unknown: name it with --side, or give the team's token")?;
    let Some(team) = caller.team else {
        bail!(
            "the token does not belong to a team: name the side with --side 1 (home) or --side 2 (away)"
        );
    };
    let team_side = Side::BOTH
        .into_iter()
        .find(|side| game.sides[side.index()].team == team.id);
    team_side.with_context(|| {
        let [home, away] = &game.sides;
        format!(
            "{} does not play in {} - {}",
            team.name, home.team_name, away.team_name
        )
    })
}
