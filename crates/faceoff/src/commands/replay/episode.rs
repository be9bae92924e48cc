//! Draws an episode, and prints the reason of its end.

use super::{
    output::{Format, Output},
    page,
    recording::{EpisodeRecording, time_s},
    table_view::target_zone,
    video::{Sample, Scene},
};
use crate::commands::output::print;
use faceoff_types::Task;
use serde_json::json;
use std::path::Path;

pub fn draw(dataset: &Path, task: Task, episode: u32, output: &Output) -> anyhow::Result<()> {
    let recording = EpisodeRecording::read(dataset, task, episode)?;
    match &output.format {
        Format::Html => output.write(page::html(&recording)?)?,
        Format::Svg => output.write(page::svg(&recording)?)?,
        Format::Video(video) => {
            let scene = scene(&recording);
            video.write(&scene, scene.whole(), &output.file)?;
        }
    }
    let penalties = recording.penalties();
    let summary = json!({
        "episode": recording.headline(),
        "why": recording.end_reason,
        "losses": penalties,
        "file": output.file,
    });
    print(output.json, &summary, |_| {
        let head = [recording.headline(), recording.end_reason.clone()];
        let file = output.file.display().to_string();
        let lines: Vec<String> = head
            .into_iter()
            .chain(penalties.clone())
            .chain([file])
            .collect();
        lines.join("\n")
    })
}

/// The episode as a video shows it.
fn scene(recording: &EpisodeRecording) -> Scene {
    // The opponent is recorded from the first step on.
    let opponent = recording.opponent.first().into_iter();
    let mut opponent = opponent.chain(&recording.opponent).copied();
    let positions = recording.puck.iter().zip(&recording.mallet);
    let samples: Vec<Sample> = positions
        .map(|([x, y, _], mallet)| Sample {
            puck: [*x, *y],
            mallets: [Some(*mallet), opponent.next()],
        })
        .collect();
    let outcome = &recording.outcome;
    let title = format!(
        "{}, episode {} of {}",
        outcome.task, outcome.episode, recording.agent
    );
    let last = samples.len().saturating_sub(1);
    Scene {
        underlay: target_zone(outcome.task),
        captions: vec![(0, title), (last, recording.headline())],
        rally_starts: vec![0],
        clock: |step| format!("{:.2} s", time_s(step)),
        samples,
    }
}
