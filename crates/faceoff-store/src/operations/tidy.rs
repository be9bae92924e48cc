use crate::{
    boxed,
    error::Result,
    event::Actor,
    queue::Claim,
    store::Store,
    tables::{bundles, drafts, runs},
};
use faceoff_types::RunId;
use jiff::{SignedDuration, Timestamp};

/// For how long the recordings of an evaluation that is over are kept. A backup that copies the
/// database first and the artifacts after it, as the handbook says, takes hours at most: what its
/// database names must still be there when the copy comes to it. Restored, that evaluation may have
/// to be played on or scored.
pub const RECORDINGS_KEPT: SignedDuration = SignedDuration::from_hours(24);

/// For how long the archive of an upload is kept that we failed to check: it may tell why.
pub const UNCHECKED_KEPT: SignedDuration = SignedDuration::from_hours(24);

/// Artifact key prefix of all recordings of a run.
fn recordings_of(run: RunId) -> String {
    format!("recordings/{run}")
}

impl Claim {
    /// Artifact key prefix for the recording made under this lease. Every lease has its own, so that
    /// a worker that lost one never mixes its files with its successor's.
    #[must_use]
    pub fn recording_key(&self, run: RunId) -> String {
        format!("{}/{}/{}", recordings_of(run), self.unit, self.nonce)
    }
}

impl Store {
    /// Removes the shard recordings of evaluations that have been over for [`RECORDINGS_KEPT`]: a
    /// finished one has them in its dataset, the others need them no more. Returns of how many
    /// runs. Run it now and then; a kill half way is made up for by the next run.
    #[boxed]
    pub async fn remove_old_recordings(&self, now: Timestamp) -> Result<usize> {
        let before = now
            .saturating_sub(RECORDINGS_KEPT)
            .unwrap_or(Timestamp::MIN);
        let mut connection = self.database.read.acquire().await?;
        let old = runs::with_old_recordings(&mut connection, before).await?;
        drop(connection);
        for run in &old {
            self.artifacts().delete_folder(&recordings_of(*run)).await?;
            self.write(Actor::Server, now, async |tx| {
                runs::set_recordings_removed(tx, *run, now).await
            })
            .await?;
        }
        Ok(old.len())
    }

    /// Removes the datasets of proposals that were dropped [`RECORDINGS_KEPT`] ago; their results stay to be read. Returns
    /// how many. A kill half way is made up for by the next call.
    #[boxed]
    pub async fn remove_dropped_datasets(&self, now: Timestamp) -> Result<usize> {
        let before = now
            .saturating_sub(RECORDINGS_KEPT)
            .unwrap_or(Timestamp::MIN);
        let mut connection = self.database.read.acquire().await?;
        let dropped = drafts::with_dropped_datasets(&mut connection, before).await?;
        drop(connection);
        for (id, key) in &dropped {
            self.artifacts().delete_dataset(key).await?;
            self.write(Actor::Server, now, async |tx| {
                drafts::set_dataset_removed(tx, *id, now).await
            })
            .await?;
        }
        Ok(dropped.len())
    }

    /// Removes the archives of uploads that were refused: at once those that are invalid, after
    /// [`UNCHECKED_KEPT`] those that we failed to check. Reason and log stay. Returns how many. A kill half
    /// way is made up for by the next call, and so is what older programs kept.
    #[boxed]
    pub async fn remove_refused_bundles(&self, now: Timestamp) -> Result<usize> {
        let before = now.saturating_sub(UNCHECKED_KEPT).unwrap_or(Timestamp::MIN);
        let mut connection = self.database.read.acquire().await?;
        let refused = bundles::refused(&mut connection, before).await?;
        drop(connection);
        for (id, key) in &refused {
            self.artifacts().delete(key).await?;
            self.write(Actor::Server, now, async |tx| {
                bundles::set_removed(tx, *id, now).await
            })
            .await?;
        }
        Ok(refused.len())
    }

    /// Removes archives that no submission names and that were stored at `before` or earlier: a process
    /// was killed between the one and the other. Returns how many.
    #[boxed]
    pub async fn remove_orphaned_bundles(&self, before: Timestamp) -> Result<usize> {
        // In this order: what is named after the first look is none of those that it found.
        let stored = self.artifacts().stored_until("bundles", before).await?;
        let kept = bundles::kept(&mut *self.database.read.acquire().await?).await?;
        let mut removed = 0;
        for key in stored.iter().filter(|key| !kept.contains(*key)) {
            self.artifacts().delete(key).await?;
            removed += 1;
        }
        Ok(removed)
    }
}
