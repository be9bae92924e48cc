//! A file of clips among the artifacts.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_replay::{Clip, EpisodeLine, Key, Pack, ReplayError};
use faceoff_types::Task;
use std::path::PathBuf;

/// All that is shown of an episode.
pub struct Episode {
    /// What it came to.
    pub line: EpisodeLine,
    /// Are there the episodes of the task before and after it?
    pub has_before: bool,
    /// Is there one after it?
    pub has_after: bool,
    pub motion: Clip,
    /// For whoever gets the dataset.
    pub observed: Option<Clip>,
}

/// A file of clips among the artifacts.
#[derive(Debug)]
pub struct ClipFile {
    /// Its name among the artifacts, which is never another's.
    pub key: String,
    path: PathBuf,
}

impl ClipFile {
    /// `None` if it is not kept.
    ///
    /// # Errors
    /// An internal problem, if nobody can tell.
    #[boxed]
    pub async fn find(app: &AppState, key: String) -> Result<Option<Self>, Problem> {
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
    #[boxed]
    pub async fn clip(&self, key: Key) -> Result<Vec<u8>, Problem> {
        let clip = self.read(move |pack| pack.clip(key)).await?;
        clip.ok_or_else(|| Problem::not_found("episode"))
    }

    /// An episode, read, as somebody sees it who gets the dataset, or everybody.
    ///
    /// # Errors
    /// `NotFound` if there is no such episode.
    #[boxed]
    pub async fn episode(
        &self,
        task: Task,
        episode: u32,
        sees_observed: bool,
    ) -> Result<Episode, Problem> {
        let read = move |pack: &Pack| {
            let sheet = pack.sheet()?;
            let clip = |key| -> Result<Option<Clip>, ReplayError> {
                let bytes = pack.clip(key)?;
                bytes.map(|bytes| Clip::read(&bytes)).transpose()
            };
            let line = sheet.line(task, episode);
            let Some((line, motion)) = line.zip(clip(Key::motion(task, episode))?) else {
                return Ok(None);
            };
            let has =
                |other: Option<u32>| other.is_some_and(|other| sheet.line(task, other).is_some());
            let mut line = line.clone();
            if !sees_observed {
                line.make_public();
            }
            Ok(Some(Episode {
                line,
                has_before: has(episode.checked_sub(1)),
                has_after: has(episode.checked_add(1)),
                motion,
                observed: match sees_observed {
                    true => clip(Key::observed(task, episode))?,
                    false => None,
                },
            }))
        };
        let found = self.read(read).await?;
        found.ok_or_else(|| Problem::not_found("episode"))
    }
}
