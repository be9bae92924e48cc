//! The files of jobs in the store of the same process.

use crate::files::FileStore;
use faceoff_store::Artifacts;
use faceoff_types::BundleRef;
use std::path::Path;
use tokio::runtime::Handle;

/// The artifacts (stored files) of the store, for the threads of slots.
#[derive(Debug, Clone)]
pub(crate) struct LocalFiles {
    pub(crate) artifacts: Artifacts,
    /// The async runtime on which these threads wait for the artifacts.
    pub(crate) runtime: Handle,
}

impl LocalFiles {
    /// Copies the files of a committed recording into an empty folder.
    pub(crate) fn fetch_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        let fetched = self.artifacts.get_folder(key, folder);
        Ok(self.runtime.block_on(fetched)?)
    }

    /// Stores a dataset, with the clips for replays. It becomes visible with the commit that names it.
    pub(crate) fn store_dataset(
        &self,
        key: &str,
        archive: &Path,
        clips: Option<&Path>,
    ) -> anyhow::Result<()> {
        let stored = self.artifacts.put_dataset(key, archive, clips);
        Ok(self.runtime.block_on(stored)?)
    }
}

impl FileStore for LocalFiles {
    fn fetch_bundle(&self, bundle: &BundleRef, archive: &Path) -> anyhow::Result<()> {
        let fetched = self.artifacts.get_to_file(&bundle.key, archive);
        Ok(self.runtime.block_on(fetched)?)
    }

    fn store_recording(&self, key: &str, folder: &Path) -> anyhow::Result<()> {
        self.runtime.block_on(async {
            let stored = self.artifacts.put_folder(key, folder).await;
            // A partial recording is useless and takes disk space.
            if stored.is_err()
                && let Err(error) = self.artifacts.delete_folder(key).await
            {
                tracing::warn!(key, %error, "a partial recording could not be removed");
            }
            Ok(stored?)
        })
    }

    fn store_clips(&self, key: &str, clips: &Path) -> anyhow::Result<()> {
        let stored = self.artifacts.put_file(key, clips);
        Ok(self.runtime.block_on(stored)?)
    }
}
