//! Withdrawal of a submission by its team, after which it is not evaluated any more.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        active_submissions, season,
        submissions::{self, Submission, SubmissionState},
    },
};
use faceoff_types::SubmissionId;
use jiff::Timestamp;

impl Store {
    /// Withdraws a submission: it is not evaluated on later days. If it was active, its team has no active submission
    /// until it chooses or uploads another one. Days past their cutoff are not affected. [`StoreError::Conflict`] if the
    /// submission is not valid, or was withdrawn; [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn withdraw_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let submission = submissions::find(tx, id).await?;
            if submission.withdrawn_at.is_some() {
                return StoreError::conflict("it is withdrawn already");
            }
            match submission.state {
                SubmissionState::Valid | SubmissionState::Validating => {}
                SubmissionState::Invalid { .. } | SubmissionState::PlatformFailed { .. } => {
                    return StoreError::conflict(
                        "it is not valid and never evaluated: there is nothing to withdraw",
                    );
                }
            }
            submissions::set_withdrawn(tx, id, Some(now)).await?;
            active_submissions::remove(tx, id).await?;
            tx.record(Subject::Submission(id), Event::SubmissionWithdrawn);
            submissions::find(tx, id).await
        })
        .await
    }
}
