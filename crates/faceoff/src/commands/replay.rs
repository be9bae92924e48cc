//! `faceoff replay`: draws an episode of a dataset or a recorded game as an HTML page, an SVG picture, or a video.

mod episode;
mod game;
mod input;
mod output;
mod page;
mod plots;
mod recording;
mod table_parts;
mod table_view;
mod video;

use crate::competition::parse_task;
use anyhow::bail;
use clap::Args;
use faceoff_types::Task;
use input::Input;
use output::Output;
use std::path::PathBuf;
use video::VideoOptions;

/// Draws a recorded game, or one episode of a dataset, as a page (.html), which is animated and needs no network, as a
/// picture (.svg), or as a video (--video). A game: the table from above, goals, fouls and faults as links into the replay, and the causes of penalty
/// points. An episode: the table, true and observed puck, speeds, constraints, computation times, and the reason of its end.
#[derive(Debug, Args)]
pub struct ReplayCommand {
    /// game.zip or a side's zip file of a game, the folder it was unpacked to, or the folder of `faceoff play --out`; or
    /// dataset.zip, the folder it was unpacked to, or the folder of `faceoff eval --out`
    recording: PathBuf,
    /// Of a dataset: the task
    #[arg(long, value_parser = parse_task, requires = "episode")]
    task: Option<Task>,
    /// Of a dataset: the episode, from 0
    #[arg(long, value_name = "N", requires = "task")]
    episode: Option<u32>,
    /// Of the folder of a series: the game, from 1 in the order of play
    #[arg(long, value_name = "N", conflicts_with = "task")]
    game: Option<u32>,
    /// Of a game: the rally, from 0, that a picture or a video shows and at which a page begins [default: a picture shows the
    /// last, a video the whole game]
    #[arg(long, value_name = "N", conflicts_with = "task")]
    rally: Option<u32>,
    /// The file to write, a page (.html) or a picture (.svg); an existing file is replaced
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "video",
        conflicts_with = "video"
    )]
    out: Option<PathBuf>,
    #[command(flatten)]
    video: VideoOptions,
    /// Print the reason of the episode's end, or the result and the events of the game, as JSON
    #[arg(long)]
    json: bool,
}

impl ReplayCommand {
    /// Draws the game or the episode, and prints its result or the reason of its end.
    ///
    /// # Errors
    /// If the recording cannot be read or lacks the episode or rally, the options do not fit it, or the file cannot be written.
    pub fn run(self) -> anyhow::Result<()> {
        let output = Output::new(self.out, &self.video, self.json)?;
        let episode = self.task.zip(self.episode);
        match Input::find(&self.recording, self.game, episode.is_some())? {
            Input::Game(path) => {
                if episode.is_some() {
                    bail!(
                        "{} is a game, which has rallies and no tasks: leave out --task and --episode (--rally N picks a rally)",
                        path.display()
                    );
                }
                game::draw(&path, self.rally, &output)
            }
            Input::Dataset(path) => {
                if self.rally.is_some() {
                    bail!(
                        "{} is the dataset of an evaluation, which has no rallies: name an episode with --task and --episode",
                        path.display()
                    );
                }
                let Some((task, episode)) = episode else {
                    bail!(
                        "{} is the dataset of an evaluation: name an episode with --task and --episode (faceoff dataset list {0} lists them)",
                        path.display()
                    );
                };
                episode::draw(&path, task, episode, &output)
            }
        }
    }
}
