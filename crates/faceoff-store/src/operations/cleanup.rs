//! Periodic deletion of what is not needed any more: recordings, datasets of dropped proposals, bundles that failed validation or have
//! no submission, and ended credentials.

use crate::{
    boxed_future,
    error::Result,
    event::Actor,
    queue::JobClaim,
    store::Store,
    tables::{bundles, invitations, retentions, runs, submissions, tokens},
};
use faceoff_types::RunId;
use jiff::{SignedDuration, Timestamp};

/// Time for which the recordings of an ended evaluation are kept. A backup copies the database first
/// and the artifacts after it (see the handbook), which takes hours at most. Artifacts that its
/// database refers to must still exist then: the restored evaluation may have to be continued or
/// scored.
pub const RECORDINGS_KEPT_FOR: SignedDuration = SignedDuration::from_hours(24);

/// Time for which a bundle is kept after a platform fault in its validation run, for investigation.
pub const PLATFORM_FAILED_BUNDLES_KEPT_FOR: SignedDuration = SignedDuration::from_hours(24);

/// Time for which tokens, sessions and invitations are kept after their end. The log keeps their events.
pub const ENDED_CREDENTIALS_KEPT_FOR: SignedDuration = SignedDuration::from_hours(30 * 24);

/// Number of ended credentials that one transaction deletes. Other changes wait for it only briefly.
const MAX_DELETED_AT_ONCE: u32 = 500;

/// Number of a team's invalid submissions whose logs are kept, the newest ones. A bundle of a few bytes can have a long log.
pub const INVALID_LOGS_KEPT: u32 = 50;

/// The instant `kept_for` before `now`. Data that ended then or earlier is deleted.
pub(super) fn earlier(now: Timestamp, kept_for: SignedDuration) -> Timestamp {
    now.saturating_sub(kept_for).unwrap_or(Timestamp::MIN)
}

/// Artifact key prefix of all recordings of a run.
fn recordings_of(run: RunId) -> String {
    format!("recordings/{run}")
}

impl JobClaim {
    /// Artifact key prefix for the recording made under this lease. Every lease has its own, so that
    /// the files of a worker that lost its lease never mix with those of the next one.
    #[must_use]
    pub fn recording_key(&self, run: RunId) -> String {
        format!("{}/{}/{}", recordings_of(run), self.job, self.nonce)
    }
}

impl Store {
    /// Deletes the recordings of evaluations that ended at least [`RECORDINGS_KEPT_FOR`] ago. A finished
    /// evaluation has them in its dataset, the others do not need them any more. Returns the number
    /// of runs. To be called periodically; an interrupted call is completed by the next one.
    #[boxed_future]
    pub async fn remove_old_recordings(&self, now: Timestamp) -> Result<usize> {
        let ended_until = earlier(now, RECORDINGS_KEPT_FOR);
        let mut connection = self.database.read.acquire().await?;
        let runs_to_clean = runs::with_old_recordings(&mut connection, ended_until).await?;
        drop(connection);
        for run in &runs_to_clean {
            self.artifacts().delete_folder(&recordings_of(*run)).await?;
            self.write(Actor::Server, now, async |tx| {
                runs::set_recordings_removed(tx, *run, now).await
            })
            .await?;
        }
        Ok(runs_to_clean.len())
    }

    /// Deletes the datasets of proposals (trials and proposed re-evaluations) that were dropped at least
    /// [`RECORDINGS_KEPT_FOR`] ago; their results stay readable. Returns the number of datasets. An interrupted call is completed by the next one.
    #[boxed_future]
    pub async fn remove_dropped_datasets(&self, now: Timestamp) -> Result<usize> {
        let ended_until = earlier(now, RECORDINGS_KEPT_FOR);
        let mut connection = self.database.read.acquire().await?;
        let dropped = retentions::dropped_with_datasets(&mut connection, ended_until).await?;
        drop(connection);
        for (id, key) in &dropped {
            self.artifacts().delete_dataset(key).await?;
            self.write(Actor::Server, now, async |tx| {
                retentions::set_dropped_dataset_deleted(tx, *id, now).await
            })
            .await?;
        }
        Ok(dropped.len())
    }

    /// Deletes the bundles of submissions that did not pass their validation run: at once if they are invalid, and
    /// [`PLATFORM_FAILED_BUNDLES_KEPT_FOR`] after a platform fault. Of their logs a team's last [`INVALID_LOGS_KEPT`] stay, and
    /// identical bundles share one; the reasons of all stay. Returns the number of bundles. An interrupted call is completed by the next one.
    #[boxed_future]
    pub async fn clean_up_failed_submissions(&self, now: Timestamp) -> Result<usize> {
        let ended_until = earlier(now, PLATFORM_FAILED_BUNDLES_KEPT_FOR);
        let mut connection = self.database.read.acquire().await?;
        let failed = bundles::with_failed_validation(&mut connection, ended_until).await?;
        drop(connection);
        for (id, key) in &failed {
            self.artifacts().delete(key).await?;
            self.write(Actor::Server, now, async |tx| {
                bundles::set_failed_removed(tx, *id, now).await?;
                submissions::share_log(tx, *id).await?;
                submissions::empty_old_logs(tx, *id, INVALID_LOGS_KEPT).await
            })
            .await?;
        }
        Ok(failed.len())
    }

    /// Deletes tokens, sessions and invitations that ended at least [`ENDED_CREDENTIALS_KEPT_FOR`] ago. Accepted invitations stay:
    /// they say who invited whom. Returns the number of deleted rows. An interrupted call is completed by the next one.
    #[boxed_future]
    pub async fn delete_ended_credentials(&self, now: Timestamp) -> Result<usize> {
        let ended_until = earlier(now, ENDED_CREDENTIALS_KEPT_FOR);
        let mut total = 0;
        loop {
            let deleted =
                self.write(Actor::Server, now, async |tx| {
                    let tokens = tokens::delete_ended(tx, ended_until, MAX_DELETED_AT_ONCE).await?;
                    Ok(tokens
                        + invitations::delete_ended(tx, ended_until, MAX_DELETED_AT_ONCE).await?)
                });
            match deleted.await? {
                0 => return Ok(total),
                deleted => total += deleted,
            }
        }
    }

    /// Deletes bundles that no submission refers to and that were stored at `stored_before` or earlier: a process
    /// was killed between storing the bundle and adding its submission. Returns the number of bundles.
    #[boxed_future]
    pub async fn remove_orphaned_bundles(&self, stored_before: Timestamp) -> Result<usize> {
        // In this order: a submission added after the files were listed has none of the listed bundles.
        let stored = self
            .artifacts()
            .stored_until("bundles", stored_before)
            .await?;
        let in_use = bundles::keys_in_use(&mut *self.database.read.acquire().await?).await?;
        let mut removed = 0;
        for key in stored.iter().filter(|key| !in_use.contains(*key)) {
            self.artifacts().delete(key).await?;
            removed += 1;
        }
        Ok(removed)
    }
}
