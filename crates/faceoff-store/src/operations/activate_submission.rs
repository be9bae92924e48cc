//! Choice of a team's active submission: the one that is evaluated from the next cutoff on.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    store::Store,
    tables::{
        active_submissions, bundles, season,
        submissions::{self, Submission, SubmissionState},
        teams,
    },
    write::Tx,
};
use faceoff_types::SubmissionId;
use jiff::Timestamp;

/// Refuses a submission that cannot be evaluated. The error says what its team can do.
fn check_valid(submission: &Submission) -> Result<()> {
    StoreError::conflict(match &submission.state {
        SubmissionState::Valid => return Ok(()),
        SubmissionState::Validating => {
            "the submission's validation run is not over: wait until it is valid".into()
        }
        SubmissionState::Invalid { reason } => {
            format!("the submission is invalid ({reason}): upload a corrected one")
        }
        SubmissionState::PlatformFailed { .. } => {
            "the submission could not be checked because of a platform fault: upload it again"
                .into()
        }
    })
}

async fn activate(tx: &mut Tx, id: SubmissionId) -> Result<Submission> {
    season::check_open(tx).await?;
    let submission = submissions::find(tx, id).await?;
    teams::check_may_compete(tx, submission.team).await?;
    check_valid(&submission)?;
    bundles::check_available(tx, id).await?;
    let now = tx.now;
    active_submissions::choose(tx, submission.team, id, now).await?;
    submissions::set_withdrawn(tx, id, None).await?;
    if !submission.active {
        tx.record(Subject::Submission(id), Event::SubmissionActivated);
    }
    submissions::find(tx, id).await
}

impl Store {
    /// Makes a submission its team's active one from the next cutoff (the daily start of the evaluations) on, until a
    /// later upload turns valid. A withdrawn submission can be chosen too. Days past their cutoff are not affected.
    /// [`StoreError::Conflict`] if the submission is not valid (yet), or its bundle was removed;
    /// [`StoreError::Disqualified`] if its team is disqualified;
    /// [`StoreError::SeasonClosed`] once the season is over.
    #[boxed_future]
    pub async fn activate_submission(
        &self,
        actor: Actor,
        id: SubmissionId,
        now: Timestamp,
    ) -> Result<Submission> {
        self.write(actor, now, async |tx| activate(tx, id).await)
            .await
    }
}
