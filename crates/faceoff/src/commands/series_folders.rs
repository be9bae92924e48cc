//! Folders of the games of a series, as `faceoff play --pairs` and `--games` write them.

use faceoff_dataset::game::GAME_FILE;
use std::path::{Path, PathBuf};

/// Folder of game `number` of a series of single games, from 1.
pub(super) fn of_game(number: u32) -> String {
    format!("game-{number}")
}

/// Folder of a half of a mirrored pair, both from 1.
pub(super) fn of_half(pair: u32, half: u32) -> String {
    format!("pair-{pair}/half-{half}")
}

/// The folder of the first game or pair of a series, if `out` has one.
pub(super) fn find_first(out: &Path) -> Option<PathBuf> {
    [of_game(1), "pair-1".to_owned()]
        .map(|name| out.join(name))
        .into_iter()
        .find(|path| path.exists())
}

/// The folders with a recorded game, in the order of play; empty if `out` is no folder of a series.
pub(super) fn recorded(out: &Path) -> Vec<String> {
    let is_recorded = |folder: &String| out.join(folder).join(GAME_FILE).exists();
    let games = (1..).map(of_game).take_while(is_recorded);
    let halves = (1..)
        .flat_map(|pair| [1, 2].map(|half| of_half(pair, half)))
        .take_while(is_recorded);
    games.chain(halves).collect()
}
