//! Clip files. A *clip* is a compressed recording: either the motion of robot and puck, which the public may see, or the agent's
//! observations and actions. A clip file holds the clips of many episodes, or of a game, and is stored as an artifact.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_replay::{Clip, ClipKey, EpisodeIndexEntry, Pack, ReplayError};
use faceoff_types::Task;
use std::path::PathBuf;

/// An episode, as far as the viewer may see it.
pub struct Episode {
    /// The summary of the episode, from the clip index.
    pub summary: EpisodeIndexEntry,
    /// Whether the file also has the task's previous episode.
    pub has_previous: bool,
    /// Whether the file also has the task's next episode.
    pub has_next: bool,
    pub motion: Clip,
    /// Observations and actions; `None` without access to the dataset.
    pub observations: Option<Clip>,
}

/// A clip file.
#[derive(Debug)]
pub struct ClipFile {
    /// The artifact key of the file; never reused for another file.
    pub key: String,
    path: PathBuf,
}

impl ClipFile {
    /// The clip file with this key; `None` if there is none.
    ///
    /// # Errors
    /// `Internal` if the artifacts cannot be read.
    #[boxed_future]
    pub async fn find(app: &AppState, key: String) -> Result<Option<Self>, Problem> {
        let artifacts = app.store.artifacts();
        if artifacts.size_bytes(&key).await?.is_none() {
            return Ok(None);
        }
        let path = artifacts.local_path(&key).map_err(Problem::internal)?;
        Ok(Some(Self { key, path }))
    }

    /// Opens the file and calls `read` with it, on a blocking thread.
    ///
    /// # Errors
    /// `Internal` if it cannot be read.
    pub async fn read<T: Send + 'static>(
        &self,
        read: impl FnOnce(&Pack) -> Result<T, ReplayError> + Send + 'static,
    ) -> Result<T, Problem> {
        let path = self.path.clone();
        tokio::task::spawn_blocking(move || read(&Pack::open(&path)?))
            .await
            .map_err(Problem::internal)?
            .map_err(Problem::internal)
    }

    /// An episode's clip, gzip-compressed.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed_future]
    pub async fn clip(&self, key: ClipKey) -> Result<Vec<u8>, Problem> {
        let clip = self.read(move |pack| pack.clip(key)).await?;
        clip.ok_or_else(|| Problem::not_found("episode"))
    }

    /// An episode with its decoded clips; observations and faults only if `can_see_observations`.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed_future]
    pub async fn episode(
        &self,
        task: Task,
        episode: u32,
        can_see_observations: bool,
    ) -> Result<Episode, Problem> {
        let read = move |pack: &Pack| {
            let index = pack.clip_index()?;
            let clip = |key| -> Result<Option<Clip>, ReplayError> {
                let bytes = pack.clip(key)?;
                bytes.map(|bytes| Clip::read(&bytes)).transpose()
            };
            let summary = index.summary(task, episode);
            let Some((summary, motion)) = summary.zip(clip(ClipKey::motion(task, episode))?) else {
                return Ok(None);
            };
            let exists = |episode: Option<u32>| {
                episode.is_some_and(|episode| index.summary(task, episode).is_some())
            };
            let mut summary = summary.clone();
            if !can_see_observations {
                summary.make_public();
            }
            Ok(Some(Episode {
                summary,
                has_previous: exists(episode.checked_sub(1)),
                has_next: exists(episode.checked_add(1)),
                motion,
                observations: match can_see_observations {
                    true => clip(ClipKey::observed(task, episode))?,
                    false => None,
                },
            }))
        };
        let episode = self.read(read).await?;
        episode.ok_or_else(|| Problem::not_found("episode"))
    }
}
