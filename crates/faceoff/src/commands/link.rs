//! `faceoff link`: creates a link that downloads a file without a token.

use super::{
    game::own_side,
    output::{print, time_text},
    resource_references::{EvaluationArg, SubmissionArg},
    server::ServerArgs,
};
use crate::client::LinkTarget;
use clap::{Args, Subcommand};
use faceoff_api::requests::NewLink;
use faceoff_types::{GameId, Side};

/// Creates a link that downloads a file without a token, until the link expires or your token becomes invalid.
#[derive(Debug, Args)]
pub struct LinkCommand {
    /// Validity in hours, at most 168
    #[arg(long, global = true, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=168))]
    hours: u32,
    #[command(flatten)]
    server: ServerArgs,
    #[command(subcommand)]
    target: Target,
}

#[derive(Debug, Subcommand)]
enum Target {
    /// The dataset of an evaluation
    Dataset {
        #[command(flatten)]
        evaluation: EvaluationArg,
    },
    /// The bundle of a submission
    Submission {
        #[command(flatten)]
        submission: SubmissionArg,
    },
    /// Your side's dataset of a game
    Game {
        /// The game's id
        game: GameId,
        /// For organisers: the side, 1 (home) or 2 (away)
        #[arg(long, value_parser = super::game::parse_side, conflicts_with = "both")]
        side: Option<Side>,
        /// The recording of both sides, if you may download it
        #[arg(long)]
        both: bool,
    },
}

impl LinkCommand {
    /// Creates the link.
    ///
    /// # Errors
    /// If the server cannot be reached or refuses.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let client = self.server.client()?;
            let target = match self.target {
                Target::Dataset { evaluation } => {
                    LinkTarget::Dataset(evaluation.find(&client).await?)
                }
                Target::Submission { submission } => {
                    LinkTarget::Submission(submission.find(&client).await?)
                }
                Target::Game { game, both, .. } if both => LinkTarget::Recording(game),
                Target::Game { game, side, .. } => {
                    let found = client.game(game).await?;
                    LinkTarget::Side(game, own_side(&client, &found, side).await?)
                }
            };
            let new = NewLink {
                expires_in_s: Some(self.hours * 3600),
            };
            let link = client.create_link(target, new).await?;
            print(self.server.json, &link, |link| {
                format!(
                    "{}\nThe link is valid until {} for everyone who has it. It is not shown again.",
                    link.url,
                    time_text(link.expires_at)
                )
            })
        })
    }
}
