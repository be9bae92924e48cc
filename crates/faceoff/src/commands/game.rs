//! `faceoff game`: games on the server, single ones, and those that a team asks for.

mod watch;

use super::{
    output::{download_bar, downloaded, print},
    server::ServerArgs,
    tournament::{find::find_or_newest, games},
};
use crate::client::Client;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use faceoff_api::views::game::GameView;
use faceoff_types::{GameId, Side, TeamName};
use std::path::PathBuf;

/// Asks for games that do not count, shows and watches games, downloads what a team may have of them.
#[derive(Debug, Args)]
pub struct GameCommand {
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Have your active submission play the organisers' baseline, before or between rounds; it does not count
    Test {
        /// The tournament's name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Have your active submission play another team's, before or between rounds; it does not count
    Friendly {
        /// The other team's name
        opponent: TeamName,
        /// The tournament's name or id [default: the newest]
        tournament: Option<String>,
    },
    /// List your games that do not count, the newest first (faceoff tournament games lists those that do)
    List {
        /// The tournament's name or id [default: the newest]
        tournament: Option<String>,
    },
    /// Show one: what it is for, how it stands, what it came to
    Show {
        /// The game's id
        game: GameId,
    },
    /// Follow one as it is played: goals, fouls, faults, as they happen, until it is over
    Watch {
        /// The game's id
        game: GameId,
    },
    /// Download your side's own file, at once after the game
    Download {
        /// The game's id
        game: GameId,
        /// Where to
        file: PathBuf,
        /// Another side's file, where it is public: 1 (home) or 2 (away)
        #[arg(long, value_parser = side, conflicts_with = "both")]
        side: Option<Side>,
        /// The recording of both sides with the game's seed, which faceoff verify plays again, where it is public
        #[arg(long)]
        both: bool,
    },
    /// Print the end of what your agent wrote to its standard error, with its faults
    Log {
        /// The game's id
        game: GameId,
        /// As an organiser: of which side, 1 (home) or 2 (away)
        #[arg(long, value_parser = side)]
        side: Option<Side>,
    },
    /// Call off a game that does not count and is not over, which your team has asked for
    Cancel {
        /// The game's id
        game: GameId,
    },
}

pub(super) fn side(text: &str) -> Result<Side, String> {
    let wanted = Side::BOTH
        .into_iter()
        .find(|side| side.number().to_string() == text);
    wanted.ok_or_else(|| format!("expected 1 (home) or 2 (away), got {text:?}"))
}

impl GameCommand {
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
            Action::Test { tournament } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let ordered = client.order_test_games(id, None).await?;
                print(self.server.json, &ordered, || games::ordered(&ordered))
            }
            Action::Friendly {
                opponent,
                tournament,
            } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let game = client.order_friendly_game(id, opponent).await?;
                print(self.server.json, &game, || games::whole(&game))
            }
            Action::List { tournament } => {
                let id = find_or_newest(&client, tournament.as_deref()).await?;
                let free = client.free_games(id).await?;
                print(self.server.json, &free, || games::table(&free))
            }
            Action::Show { game } => {
                let game = client.game(game).await?;
                print(self.server.json, &game, || games::whole(&game))
            }
            Action::Watch { game } => watch::follow(&client, self.server.json, game).await,
            Action::Download {
                game,
                file,
                side,
                both,
            } => {
                let bar = download_bar()?;
                let done = if both {
                    client.download_recording(game, &file, &bar).await?
                } else {
                    let side = own_side(&client, &client.game(game).await?, side).await?;
                    client.download_side(game, side, &file, &bar).await?
                };
                bar.finish_and_clear();
                print(self.server.json, &done, || downloaded(&done))
            }
            Action::Log { game, side } => {
                let side = own_side(&client, &client.game(game).await?, side).await?;
                print!("{}", client.game_log(game, side).await?);
                Ok(())
            }
            Action::Cancel { game } => {
                let game = client.cancel_game(game).await?;
                print(self.server.json, &game, || games::whole(&game))
            }
        }
    }
}

/// The side that was asked for, or that of the team whose token it is.
pub(super) async fn own_side(
    client: &Client,
    game: &GameView,
    wanted: Option<Side>,
) -> anyhow::Result<Side> {
    if let Some(side) = wanted {
        return Ok(side);
    }
    let who = client
        .whoami()
        .await
        .context("whose side? name it with --side, or give the team's token")?;
    let Some(team) = who.team else {
        bail!("the token is no team's: name the side with --side 1 (home) or --side 2 (away)");
    };
    let own = Side::BOTH
        .into_iter()
        .find(|side| game.sides[side.index()].team == team.id);
    own.with_context(|| {
        let [home, away] = &game.sides;
        format!(
            "{} does not play in {} - {}",
            team.name, home.team_name, away.team_name
        )
    })
}
