//! The kind of recording that a path names: a game, a game of a series, or the dataset of an evaluation.

use crate::{commands::series_folders, competition::competition};
use anyhow::{Context, bail};
use faceoff_dataset::{Dataset, game::GameRecording};
use std::{
    fs,
    path::{Path, PathBuf},
};

pub enum Input {
    /// A recorded game of two sides, or a side's own archive.
    Game(PathBuf),
    Dataset(PathBuf),
}

/// What a path may name, for errors.
const EXPECTED: &str = "game.zip, a side's zip file of a game, the folder of faceoff play, dataset.zip, or the folder of faceoff eval";

impl Input {
    /// Finds the recording. `game` is the number of a game of a series; `is_episode`: the command line names an episode.
    pub fn find(path: &Path, game: Option<u32>, is_episode: bool) -> anyhow::Result<Self> {
        let metadata = fs::metadata(path)
            .with_context(|| format!("{}: expected {EXPECTED}", path.display()))?;
        if GameRecording::is_at(path)? {
            if game.is_some() {
                bail!("{} is a single game: leave out --game", path.display());
            }
            return Ok(Self::Game(path.to_owned()));
        }
        let series = match metadata.is_dir() {
            true => series_folders::recorded(path),
            false => Vec::new(),
        };
        if !series.is_empty() {
            return Ok(Self::Game(
                path.join(choose_game_folder(path, &series, game)?),
            ));
        }
        if game.is_some() {
            bail!(
                "{} is not the folder of a series of games: leave out --game, or name the folder that faceoff play --games or --pairs wrote",
                path.display()
            );
        }
        // With --task and --episode, reading the episode gives the more exact error.
        if !is_episode {
            Dataset::open_lazily(path, competition()).with_context(|| {
                format!(
                    "{} is neither a game nor a dataset that can be read: expected {EXPECTED}; if it was downloaded, download it again",
                    path.display()
                )
            })?;
        }
        Ok(Self::Dataset(path.to_owned()))
    }
}

/// The folder of the chosen game of a series.
fn choose_game_folder<'a>(
    path: &Path,
    series: &'a [String],
    game: Option<u32>,
) -> anyhow::Result<&'a str> {
    let count = series.len();
    let range = match (&series[0], &series[count - 1]) {
        (_, _) if count == 1 => format!("it has 1 game, {}: --game 1", series[0]),
        (first, last) => {
            format!("it has {count} games, --game 1 ({first}) to --game {count} ({last})")
        }
    };
    let Some(number) = game else {
        bail!(
            "{} is the folder of a series: name a game; {range}",
            path.display()
        );
    };
    let index = (number as usize).checked_sub(1);
    match index.and_then(|index| series.get(index)) {
        Some(folder) => Ok(folder),
        None => bail!("{} has no game {number}: {range}", path.display()),
    }
}
