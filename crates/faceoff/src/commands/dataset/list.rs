//! `faceoff dataset list`: one line per episode.

use crate::competition::competition;
use crate::terminal;
use clap::Args;
use faceoff_dataset::Dataset;
use std::{io::Write, path::PathBuf};

/// Lists the episodes of a dataset.
#[derive(Debug, Args)]
pub struct ListArgs {
    /// dataset.zip, the folder it was unpacked to, or the folder of `faceoff eval --out`
    dataset: PathBuf,
    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

impl ListArgs {
    pub fn run(self) -> anyhow::Result<()> {
        let episodes = Dataset::open_lazily(&self.dataset, competition())?.episodes()?;
        let mut out = terminal::stdout();
        if !self.json {
            writeln!(
                out,
                "{:<8} {:>7} {:>6} {:<14} {:<8} {:>6}",
                "task", "episode", "steps", "end", "success", "points"
            )?;
        }
        for record in episodes {
            if self.json {
                serde_json::to_writer(&mut out, &record)?;
                writeln!(out)?;
            } else {
                let episode = &record.outcome;
                writeln!(
                    out,
                    "{:<8} {:>7} {:>6} {:<14} {:<8} {:>6}",
                    episode.task,
                    episode.episode,
                    episode.steps,
                    episode.end.as_str(),
                    if episode.success { "yes" } else { "no" },
                    record.penalty_points,
                )?;
            }
        }
        Ok(out.flush()?)
    }
}
