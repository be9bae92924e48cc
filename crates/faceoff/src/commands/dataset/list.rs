//! `faceoff dataset list`: one line per episode, or per rally of a game.

use crate::competition::competition;
use crate::terminal;
use clap::Args;
use faceoff_dataset::{
    Dataset,
    game::{GameRecording, ListedRally},
};
use faceoff_types::CONTROL_STEP_S;
use std::{io::Write, path::PathBuf};

/// Lists the episodes of a dataset, or the rallies of a game: when and why each ended, and the score after it.
#[derive(Debug, Args)]
pub struct ListArgs {
    /// dataset.zip or game.zip, the folder it was unpacked to, or the folder of `faceoff eval --out` or `faceoff play --out`
    dataset: PathBuf,
    /// Print one JSON object per line
    #[arg(long)]
    json: bool,
}

impl ListArgs {
    pub fn run(self) -> anyhow::Result<()> {
        if GameRecording::is_at(&self.dataset)? {
            return self.list_rallies();
        }
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

    fn list_rallies(&self) -> anyhow::Result<()> {
        let rallies = GameRecording::open(&self.dataset)?.rallies()?;
        let mut out = terminal::stdout();
        if !self.json {
            writeln!(
                out,
                "{:>5} {:>8} {:>6} {:>6} {:<11} {:>4} {:>5}",
                "rally", "end", "steps", "serves", "why", "by", "score"
            )?;
        }
        for rally in rallies {
            if self.json {
                serde_json::to_writer(&mut out, &rally)?;
                writeln!(out)?;
                continue;
            }
            let ListedRally {
                score: [first, second],
                by,
                ..
            } = &rally;
            writeln!(
                out,
                "{:>5} {:>7.2}s {:>6} {:>6} {:<11} {:>4} {first:>2}:{second}",
                rally.rally,
                (f64::from(rally.game_step) + f64::from(rally.steps)) * CONTROL_STEP_S,
                rally.steps,
                rally.serves,
                rally.end,
                by.map_or("–".to_owned(), |by| by.to_string()),
            )?;
        }
        Ok(out.flush()?)
    }
}
