//! `faceoff replay`: draws an episode as an HTML page or an SVG picture.

mod page;
mod plots;
mod recording;
mod table_view;

use super::output::print;
use crate::competition::parse_task;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_types::Task;
use recording::EpisodeRecording;
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Draws one episode of a dataset: the table from above, true and observed puck, speeds, constraints, computation
/// times, and the reason of its end. An .html page is animated and needs no network.
#[derive(Debug, Args)]
pub struct ReplayCommand {
    /// dataset.zip, the folder it was unpacked to, or the folder of `faceoff eval --out`
    dataset: PathBuf,
    /// The task
    #[arg(long, value_parser = parse_task)]
    task: Task,
    /// The episode, from 0
    #[arg(long, value_name = "N")]
    episode: u32,
    /// The file to write, a page (.html) or a picture (.svg); an existing file is replaced
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the reason of the episode's end as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Html,
    Svg,
}

impl Format {
    fn of(path: &Path) -> anyhow::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("html" | "htm") => Ok(Self::Html),
            Some("svg") => Ok(Self::Svg),
            _ => bail!(
                "--out: expected a file that ends in .html or .svg, got {}",
                path.display()
            ),
        }
    }
}

impl ReplayCommand {
    /// Reads the episode, draws it, and prints the reason of its end.
    ///
    /// # Errors
    /// If the dataset cannot be read or lacks the episode, or the file cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let format = Format::of(&self.out)?;
        let recording = EpisodeRecording::read(&self.dataset, self.task, self.episode)?;
        let text = match format {
            Format::Html => page::html(&recording)?,
            Format::Svg => page::svg(&recording)?,
        };
        fs::write(&self.out, text).with_context(|| format!("writing {}", self.out.display()))?;
        let losses = recording.losses();
        let summary = json!({
            "episode": recording.headline(),
            "why": recording.end_reason,
            "losses": losses,
            "file": self.out,
        });
        print(self.json, &summary, |_| {
            let head = [recording.headline(), recording.end_reason.clone()];
            let file = self.out.display().to_string();
            let lines: Vec<String> = head
                .into_iter()
                .chain(losses.clone())
                .chain([file])
                .collect();
            lines.join("\n")
        })
    }
}
