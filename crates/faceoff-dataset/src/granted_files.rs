//! Which files a *grant* allows its holder to write. A grant is a worker's permission to access the files of one job.

use crate::{files::CLIPS_FILE, game::GAME_FILES, shard_folder::SHARD_FILES};
use faceoff_wire::grant::{ExpectedRecording, Grant, WriteScope};

/// Names of the files that may be written under a grant.
#[must_use]
pub fn writable_files(grant: &Grant) -> &'static [&'static str] {
    match (&grant.write_scope, &grant.expected_recording) {
        (WriteScope::Folder(_), ExpectedRecording::Shard(_)) => &SHARD_FILES,
        (WriteScope::Folder(_), ExpectedRecording::Game(_)) => &GAME_FILES,
        // A job of an ablation, of which only the clips are stored.
        (WriteScope::File(_), _) => &[CLIPS_FILE],
        (WriteScope::Folder(_), ExpectedRecording::None) | (WriteScope::None, _) => &[],
    }
}
