//! `faceoff dataset`: downloads datasets and prints their content. A *dataset* records every control step of an evaluation's
//! episodes.

pub(super) mod download;
mod list;
mod moved_export;
mod slice;

use clap::{Args, Subcommand};

/// Downloads datasets and prints their content.
#[derive(Debug, Args)]
pub struct DatasetCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the episodes with their ends and penalty points
    List(list::ListArgs),
    /// Print the control steps of an episode as CSV or JSON lines
    Slice(slice::SliceArgs),
    /// Download the dataset of an evaluation; an interrupted download is resumed
    Download(download::DownloadArgs),
    /// Moved to the Python package: python -m faceoff.dataset export
    #[command(hide = true)]
    Export(moved_export::MovedExportArgs),
}

impl DatasetCommand {
    /// Runs the chosen action. Files that are read completely are compared with their hashes.
    ///
    /// # Errors
    /// If the dataset cannot be read, is damaged, or lacks the requested episode or column.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::List(args) => args.run(),
            Action::Slice(args) => args.run(),
            Action::Download(args) => args.run(),
            Action::Export(args) => args.run(),
        }
    }
}
