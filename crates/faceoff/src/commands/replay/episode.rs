//! Draws an episode, and prints the reason of its end.

use super::{
    output::{Format, Output},
    page,
    recording::EpisodeRecording,
};
use crate::commands::output::print;
use faceoff_types::Task;
use serde_json::json;
use std::path::Path;

pub fn draw(dataset: &Path, task: Task, episode: u32, output: &Output) -> anyhow::Result<()> {
    let recording = EpisodeRecording::read(dataset, task, episode)?;
    output.write(match output.format {
        Format::Html => page::html(&recording)?,
        Format::Svg => page::svg(&recording)?,
    })?;
    let losses = recording.losses();
    let summary = json!({
        "episode": recording.headline(),
        "why": recording.end_reason,
        "losses": losses,
        "file": output.file,
    });
    print(output.json, &summary, |_| {
        let head = [recording.headline(), recording.end_reason.clone()];
        let file = output.file.display().to_string();
        let lines: Vec<String> = head
            .into_iter()
            .chain(losses.clone())
            .chain([file])
            .collect();
        lines.join("\n")
    })
}
