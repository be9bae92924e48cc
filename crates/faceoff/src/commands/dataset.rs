//! `faceoff dataset`: looks into a dataset and cuts pieces out of it.

pub(super) mod download;
mod list;
mod moved;
mod slice;

use clap::{Args, Subcommand};

/// Looks into a dataset.
#[derive(Debug, Args)]
pub struct DatasetCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// The episodes: how each ended and what it cost
    List(list::ListArgs),
    /// One episode's control steps as CSV or JSON lines
    Slice(slice::SliceArgs),
    /// Download the dataset of an evaluation; one that broke off goes on where it was
    Download(download::DownloadArgs),
    /// Moved to the Python package: python -m faceoff.dataset export
    #[command(hide = true)]
    Export(moved::MovedArgs),
}

impl DatasetCommand {
    /// Reads what it needs of the dataset: files that are read as a whole are compared with their hashes.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or does not hold what was asked for.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::List(args) => args.run(),
            Action::Slice(args) => args.run(),
            Action::Download(args) => args.run(),
            Action::Export(args) => args.run(),
        }
    }
}
