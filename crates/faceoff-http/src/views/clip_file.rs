//! A file of clips among the artifacts.

use crate::{app::AppState, problem::Problem};
use faceoff_replay::{Pack, ReplayError};
use std::path::PathBuf;

#[derive(Debug)]
pub(crate) struct ClipFile {
    /// Its name among the artifacts, which is never another's.
    pub(crate) key: String,
    path: PathBuf,
}

impl ClipFile {
    /// `None` if it is not kept.
    ///
    /// # Errors
    /// An internal problem, if nobody can tell.
    pub(crate) async fn find(app: &AppState, key: String) -> Result<Option<Self>, Problem> {
        let artifacts = app.store.artifacts();
        if artifacts.bytes_of(&key).await?.is_none() {
            return Ok(None);
        }
        let path = artifacts.path_of(&key).map_err(Problem::internal)?;
        Ok(Some(Self { key, path }))
    }

    /// Opens it beside the handlers of other requests.
    ///
    /// # Errors
    /// An internal problem, if it cannot be read.
    pub(crate) async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&Pack) -> Result<T, ReplayError> + Send + 'static,
    ) -> Result<T, Problem> {
        let path = self.path.clone();
        tokio::task::spawn_blocking(move || read(&Pack::open(&path)?))
            .await
            .map_err(Problem::internal)?
            .map_err(Problem::internal)
    }
}
