//! `faceoff season`: what is played, and by what commitment.

use super::{output::print, server::ServerArgs};
use clap::Args;
use faceoff_api::views::season::SeasonView;

/// Shows the season: its name, its commitment, its state.
#[derive(Debug, Args)]
pub struct SeasonCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl SeasonCommand {
    /// Asks the server.
    ///
    /// # Errors
    /// If it cannot be reached.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let season = self.server.anybody()?.season().await?;
            print(self.server.json, &season, || of_season(&season))
        })
    }
}

/// The season in words.
pub(super) fn of_season(season: &SeasonView) -> String {
    let state = match (season.closed_at, season.secret) {
        (Some(closed_at), Some(secret)) => {
            let closed_at = closed_at.strftime("%Y-%m-%d %H:%M UTC");
            format!("closed     {closed_at}\nsecret     {secret}")
        }
        _ if season.archived.is_some() => {
            "open       it was, so that its secret is not here".to_owned()
        }
        _ => "open       its secret is published when it is closed".to_owned(),
    };
    let archived = match &season.archived {
        Some(archived) => format!(
            "\narchived   as it was on {}, the {} edition: nothing changes any more",
            archived.made_at.strftime("%Y-%m-%d %H:%M UTC"),
            archived.edition
        ),
        None => String::new(),
    };
    let queue = match &season.paused {
        Some(ruling) => {
            let since = ruling.at.strftime("%Y-%m-%d %H:%M UTC");
            format!("\npaused     since {since}: {}", ruling.reason)
        }
        None => String::new(),
    };
    format!(
        "{} ({}), {} days played\ncommitment {}\n{state}{queue}{archived}",
        season.name,
        season.ruleset,
        season.days.len(),
        season.commitment
    )
}
