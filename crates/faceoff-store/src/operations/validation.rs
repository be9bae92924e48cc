//! Outcome of a validation run: the check whether an uploaded agent can be evaluated.

use crate::{
    boxed_future,
    error::Result,
    event::{Event, Subject},
    operations::{
        commit_job::{CommitOutcome, wrong_job},
        job_purpose::JobPurpose,
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
    /// Stores the outcome of a validation run. A valid submission becomes its team's active one, unless the team has
    /// withdrawn it, or has uploaded or chosen another one since. Idempotent, as [`Store::commit_shard`] is.
    #[boxed_future]
    pub async fn commit_validation(
        &self,
        claim: &JobClaim,
        outcome: ValidationOutcome,
        now: Timestamp,
    ) -> Result<CommitOutcome> {
        self.commit(claim, now, async |tx, purpose| {
            let JobPurpose::Validation(id) = purpose else {
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
                    let name_and_runtime = (agent_name.as_str(), runtime.as_str());
                    submissions::set_valid(tx, id, name_and_runtime, &timing, &log).await?;
                    tx.record(subject, Event::SubmissionValid { agent_name });
                    let Submission {
                        team,
                        created_at,
                        withdrawn_at,
                        ..
                    } = submissions::find(tx, id).await?;
                    if withdrawn_at.is_none()
                        && active_submissions::activate_unless_superseded(tx, team, id, created_at)
                            .await?
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
                    let name_and_runtime = (agent_name.as_deref(), runtime.as_deref());
                    submissions::set_invalid(tx, id, name_and_runtime, &reason, &timing, &log)
                        .await?;
                    tx.record(subject, Event::SubmissionInvalid { reason });
                }
            }
            Ok(())
        })
        .await
    }
}
