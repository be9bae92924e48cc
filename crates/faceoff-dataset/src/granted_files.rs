//! Which files an order lets its holder store.

use crate::{files::CLIPS_FILE, game::GAME_FILES, shard_folder::SHARD_FILES};
use faceoff_wire::grant::{Grant, ExpectedRecording, WriteScope};

/// The files that may be stored under an order, by name.
#[must_use]
pub fn files_of(grant: &Grant) -> &'static [&'static str] {
    match (&grant.write_scope, &grant.expected_recording) {
        (WriteScope::Folder(_), ExpectedRecording::Shard(_)) => &SHARD_FILES,
        (WriteScope::Folder(_), ExpectedRecording::Game(_)) => &GAME_FILES,
        (WriteScope::File(_), _) => &[CLIPS_FILE],
        (WriteScope::Folder(_), ExpectedRecording::None) | (WriteScope::None, _) => &[],
    }
}
