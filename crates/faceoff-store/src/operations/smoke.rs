use crate::{
    error::Result,
    event::{Event, Subject},
    operations::{
        commit::{Committed, other_work},
        purpose::Purpose,
    },
    queue::Claim,
    store::Store,
    tables::submissions,
};
use faceoff_types::SmokeOutcome;
use jiff::Timestamp;

impl Store {
    /// Stores what a smoke run found. Idempotent, as [`Store::commit_shard`] is.
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
            let event = match outcome {
                SmokeOutcome::Valid {
                    agent_name,
                    timing,
                    log,
                } => {
                    submissions::set_valid(tx, id, &agent_name, &timing, &log).await?;
                    Event::SubmissionValid { agent_name }
                }
                SmokeOutcome::Invalid {
                    agent_name,
                    reason,
                    timing,
                    log,
                } => {
                    submissions::set_invalid(tx, id, agent_name.as_deref(), &reason, &timing, &log)
                        .await?;
                    Event::SubmissionInvalid { reason }
                }
            };
            tx.record(Subject::Submission(id), event);
            Ok(())
        })
        .await
    }
}
