//! `faceoff season`: prints the season. Its *secret* determines the episodes of all evaluations and is published at the end; the
//! *commitment*, its hash, is public from the start.

use super::{
    output::{print, time_text},
    server::ServerArgs,
};
use clap::Args;
use faceoff_api::views::season::SeasonView;

/// Shows the season: its name, its commitment (the hash of its secret) and its state.
#[derive(Debug, Args)]
pub struct SeasonCommand {
    #[command(flatten)]
    server: ServerArgs,
}

impl SeasonCommand {
    /// Requests the season and prints it.
    ///
    /// # Errors
    /// If the server cannot be reached.
    pub fn run(self) -> anyhow::Result<()> {
        super::block_on(async {
            let season = self.server.client_with_optional_token()?.season().await?;
            print(self.server.json, &season, season_text)
        })
    }
}

/// The season as text.
pub(super) fn season_text(season: &SeasonView) -> String {
    let state = match (season.closed_at, season.secret) {
        (Some(closed_at), Some(secret)) => {
            let closed_at = time_text(closed_at);
            format!("closed     {closed_at}\nsecret     {secret}")
        }
        _ if season.archived.is_some() => {
            "open       at the time of the archive, which therefore has no secret".to_owned()
        }
        _ => "open       the secret is published when the season is closed".to_owned(),
    };
    let archived = match &season.archived {
        Some(archived) => format!(
            "\narchived   {}, {} edition, read-only",
            time_text(archived.made_at),
            archived.edition
        ),
        None => String::new(),
    };
    let pause_text = match &season.paused {
        Some(decision) => {
            let since = time_text(decision.at);
            format!("\npaused     since {since}: {}", decision.reason)
        }
        None => String::new(),
    };
    format!(
        "{} ({}), {} evaluation days\ncommitment {}\n{state}{pause_text}{archived}",
        season.name,
        season.ruleset,
        season.days.len(),
        season.commitment
    )
}
