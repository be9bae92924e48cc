//! `faceoff link`: a link by which somebody without a token downloads a file.

use super::{game::own_side, output::print, server::ServerArgs};
use crate::client::Linked;
use clap::{Args, Subcommand};
use faceoff_api::requests::NewLink;
use faceoff_types::{EvaluationId, GameId, Side, SubmissionId};

/// Makes a link by which whoever has it downloads a file, without a token, until it expires or your token does.
#[derive(Debug, Args)]
pub struct LinkCommand {
    /// For how many hours it is good, up to 168
    #[arg(long, global = true, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=168))]
    hours: u32,
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    to: To,
}

#[derive(Debug, Subcommand)]
enum To {
    /// The dataset of an evaluation
    Dataset {
        /// The evaluation's id
        evaluation: EvaluationId,
    },
    /// The archive of a submission
    Submission {
        /// The submission's id
        submission: SubmissionId,
    },
    /// Your side's own file of a game
    Game {
        /// The game's id
        game: GameId,
        /// As an organiser: of which side, 1 (home) or 2 (away)
        #[arg(long, value_parser = super::game::side, conflicts_with = "both")]
        side: Option<Side>,
        /// The recording of both sides, if you may have it
        #[arg(long)]
        both: bool,
    },
}

impl LinkCommand {
    /// Makes it.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            let to = match self.to {
                To::Dataset { evaluation } => Linked::Dataset(evaluation),
                To::Submission { submission } => Linked::Submission(submission),
                To::Game { game, both, .. } if both => Linked::Recording(game),
                To::Game { game, side, .. } => {
                    let found = client.game(game).await?;
                    Linked::Side(game, own_side(&client, &found, side).await?)
                }
            };
            let wanted = NewLink {
                expires_in_s: Some(self.hours * 3600),
            };
            let made = client.link(to, wanted).await?;
            print(self.server.json, &made, || {
                format!(
                    "{}\nIt is good until {}, for whoever has it; it is not shown again.",
                    made.url,
                    made.expires_at.strftime("%Y-%m-%d %H:%M UTC")
                )
            })
        })
    }
}
