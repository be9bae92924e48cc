//! `faceoff admin pause`, `resume`, `accept-clock`, `export` and `season`: the queue of all jobs, the server's clock, the archive and the
//! end of the season.

use super::export::export;
use crate::{
    client::Client,
    commands::{output::print, season::season_text},
};
use anyhow::bail;
use clap::Subcommand;
use faceoff_api::views::season::SeasonView;
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub(super) enum SeasonAction {
    /// Pause the queue: running jobs finish, no further job starts
    Pause {
        /// Shown publicly
        reason: String,
    },
    /// Resume a paused queue
    Resume,
    /// Accept the server's system clock after it was set; without --confirm, only say what that changes
    AcceptClock {
        /// The size of the step, as confirmation, e.g. "3600 s ahead"
        #[arg(long, value_name = "SIZE")]
        confirm: Option<String>,
    },
    /// Download the season as one archive, which `faceoff import` shows read-only on another server
    Export {
        /// The file to write, e.g. season.tar.zst; an existing file is not overwritten
        file: PathBuf,
        /// Only public data: no submissions, no users, nothing hidden
        #[arg(long)]
        public: bool,
    },
    /// Show the season, or close it
    Season {
        #[command(subcommand)]
        action: ShowOrClose,
    },
}

#[derive(Debug, Subcommand)]
pub(super) enum ShowOrClose {
    /// Show the season's name, its commitment (the hash of its secret) and its state
    Show,
    /// Close the season permanently: its secret is published, uploads and evaluations end
    Close {
        /// The season's name, as confirmation: this cannot be undone
        #[arg(long, value_name = "NAME")]
        confirm: Option<String>,
    },
}

pub(super) async fn run_action(
    client: &Client,
    json: bool,
    action: SeasonAction,
) -> anyhow::Result<()> {
    let season = match action {
        SeasonAction::Pause { reason } => {
            client.pause(reason).await?;
            client.season().await?
        }
        SeasonAction::Resume => {
            client.resume().await?;
            client.season().await?
        }
        SeasonAction::AcceptClock { confirm } => {
            client.accept_clock(confirm).await?;
            client.season().await?
        }
        SeasonAction::Export { file, public } => return export(client, json, &file, public).await,
        SeasonAction::Season { action } => match action {
            ShowOrClose::Show => client.season().await?,
            ShowOrClose::Close { confirm } => close(client, confirm).await?,
        },
    };
    print(json, &season, season_text)
}

async fn close(client: &Client, confirm: Option<String>) -> anyhow::Result<SeasonView> {
    let Some(confirm) = confirm else {
        let season = client.season().await?;
        bail!(
            "closing {:?} publishes its secret and ends uploads and evaluations; this cannot \
            be undone. To close it, run: faceoff admin season close --confirm {:?}",
            season.name,
            season.name
        );
    };
    client.close_season(confirm).await
}
