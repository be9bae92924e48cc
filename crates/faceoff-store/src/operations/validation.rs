use crate::{
    boxed,
    error::Result,
    event::{Event, Subject},
    operations::{
        commit::{CommitOutcome, wrong_job},
        purpose::Purpose,
    },
    queue::JobClaim,
    store::Store,
    tables::{
        active_submissions,
        submissions::{self, Submission},
    },
};
use faceoff_types::ValidationOutcome;
use jiff::Timestamp;

impl Store {
    /// Stores the outcome of a validation run. If valid, the team's newest submission becomes its active one. Not
    /// if the team has chosen another one since the upload, or has withdrawn it. Idempotent, as
    /// [`Store::commit_shard`] is.
    #[boxed]
    pub async fn commit_validation(
        &self,
        claim: &JobClaim,
        outcome: ValidationOutcome,
        now: Timestamp,
    ) -> Result<CommitOutcome> {
        self.commit(claim, now, async |tx, purpose| {
            let Purpose::Validation(id) = purpose else {
                return Err(wrong_job("validation run", &purpose));
            };
            let subject = Subject::Submission(id);
            match outcome {
                ValidationOutcome::Valid {
                    agent_name,
                    runtime,
                    timing,
                    log,
                } => {
                    let named = (agent_name.as_str(), runtime.as_str());
                    submissions::set_valid(tx, id, named, &timing, &log).await?;
                    tx.record(subject, Event::SubmissionValid { agent_name });
                    let Submission {
                        team,
                        created_at,
                        withdrawn_at,
                        ..
                    } = submissions::find(tx, id).await?;
                    if withdrawn_at.is_none()
                        && active_submissions::put_newest(tx, team, id, created_at).await?
                    {
                        tx.record(subject, Event::SubmissionActivated);
                    }
                }
                ValidationOutcome::Invalid {
                    agent_name,
                    runtime,
                    reason,
                    timing,
                    log,
                } => {
                    let named = (agent_name.as_deref(), runtime.as_deref());
                    submissions::set_invalid(tx, id, named, &reason, &timing, &log).await?;
                    tx.record(subject, Event::SubmissionInvalid { reason });
                }
            }
            Ok(())
        })
        .await
    }
}
