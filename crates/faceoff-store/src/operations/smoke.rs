use crate::{
    boxed,
    error::Result,
    event::{Event, Subject},
    operations::{
        commit::{Committed, other_work},
        purpose::Purpose,
    },
    queue::Claim,
    store::Store,
    tables::{
        active_submissions,
        submissions::{self, Submission},
    },
};
use faceoff_types::SmokeOutcome;
use jiff::Timestamp;

impl Store {
    /// Stores what a smoke run found. The newest upload that is valid becomes its team's active one,
    /// unless the team has chosen one since it was uploaded, or has withdrawn it. Idempotent, as [`Store::commit_shard`] is.
    #[boxed]
    pub async fn commit_smoke(
        &self,
        claim: &Claim,
        outcome: SmokeOutcome,
        now: Timestamp,
    ) -> Result<Committed> {
        self.commit(claim, now, async |tx, purpose| {
            let Purpose::Smoke(id) = purpose else {
                return Err(other_work("smoke run", &purpose));
            };
            let subject = Subject::Submission(id);
            match outcome {
                SmokeOutcome::Valid {
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
                SmokeOutcome::Invalid {
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
