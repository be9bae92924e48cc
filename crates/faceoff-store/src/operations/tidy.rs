use crate::{error::Result, event::Actor, queue::Claim, store::Store, tables::runs};
use faceoff_types::RunId;
use jiff::{SignedDuration, Timestamp};

/// For how long the recordings of an evaluation that is over are kept. A backup that copies the
/// database first and the artifacts after it, as the handbook says, takes hours at most: what its
/// database names must still be there when the copy comes to it. Restored, that evaluation may have
/// to be played on or scored.
pub const RECORDINGS_KEPT: SignedDuration = SignedDuration::from_hours(24);

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
}
