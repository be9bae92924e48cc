//! Which files an order lets its holder store.

use crate::{files::CLIPS_FILE, game::GAME_FILES, shard_folder::SHARD_FILES};
use faceoff_wire::grant::{Grant, Plays, Writes};

/// The files that may be stored under an order, by name.
#[must_use]
pub fn files_of(grant: &Grant) -> &'static [&'static str] {
    match (&grant.writes, &grant.plays) {
        (Writes::Folder(_), Plays::Shard(_)) => &SHARD_FILES,
        (Writes::Folder(_), Plays::Game(_)) => &GAME_FILES,
        (Writes::File(_), _) => &[CLIPS_FILE],
        (Writes::Folder(_), Plays::Nothing) | (Writes::Nothing, _) => &[],
    }
}
