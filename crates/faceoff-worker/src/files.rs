//! The files of jobs that run agents: where a slot gets bundles, and where it stores recordings and clips.

use faceoff_types::BundleRef;
use std::path::Path;

/// The files of the job that a slot runs, in this process's store or on another machine. A slot has its own thread, so all
/// calls block.
pub(crate) trait FileStore: Send + Sync {
    /// Copies an uploaded bundle to a new file.
    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()>;

    /// Stores the files of a folder as a recording (of a shard or a game).
    fn store_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()>;

    /// Stores the clips (motions for replays) of a shard's episodes, replacing earlier ones.
    fn store_clips(&self, key: &str, clips: &Path) -> anyhow::Result<()>;
}
