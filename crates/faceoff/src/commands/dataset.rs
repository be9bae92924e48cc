//! `faceoff dataset`: looks into a dataset, cuts pieces out of it, and writes the 2023 layout.

mod export;
mod list;
mod npy;
mod pickle;
mod slice;

use clap::{Args, Subcommand};

/// Looks into a dataset and converts it.
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
    /// The layout of the 2023 challenge: NumPy arrays and pickled transitions
    Export(export::ExportArgs),
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
            Action::Export(args) => args.run(),
        }
    }
}
