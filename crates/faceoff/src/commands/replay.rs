//! `faceoff replay`: an episode as a page to look at.

mod page;
mod plots;
mod recorded;
mod table_view;

use super::output::print;
use anyhow::{Context, bail};
use clap::Args;
use faceoff_types::Task;
use recorded::Recorded;
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Draws one episode of a dataset: the table from above, what was observed beside what was true, speeds, constraints and
/// computation times, and why it ended as it did. An .html page can be played; it asks for nothing from the network.
#[derive(Debug, Args)]
pub struct ReplayCommand {
    /// dataset.zip, the folder it was unpacked to, or the folder that `faceoff eval` wrote
    dataset: PathBuf,
    /// The task
    #[arg(long)]
    task: Task,
    /// The episode, from 0
    #[arg(long, value_name = "N")]
    episode: u32,
    /// Where to write it: a page (.html) or a picture (.svg); one that is there is replaced
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print why it ended as JSON
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
    /// Reads the episode, draws it, and prints why it ended.
    ///
    /// # Errors
    /// If the dataset cannot be read or does not hold the episode, or the file cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let format = Format::of(&self.out)?;
        let recorded = Recorded::read(&self.dataset, self.task, self.episode)?;
        let text = match format {
            Format::Html => page::html(&recorded)?,
            Format::Svg => page::svg(&recorded)?,
        };
        fs::write(&self.out, text).with_context(|| format!("writing {}", self.out.display()))?;
        let losses = recorded.losses();
        let told = json!({
            "episode": recorded.headline(),
            "why": recorded.why,
            "losses": losses,
            "file": self.out,
        });
        print(self.json, &told, || {
            let head = [recorded.headline(), recorded.why.clone()];
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
