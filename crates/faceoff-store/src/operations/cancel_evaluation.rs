//! Cancellation of an evaluation by an organiser.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::Actor,
    operations::run_completion,
    queries,
    store::Store,
    tables::evaluations::Failure,
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;

impl Store {
    /// Stops an evaluation that is not over. Workers that run its shards (parts of its episodes) learn of it at their next
    /// heartbeat. If it was the last open one of its day, the day is released.
    #[boxed_future]
    pub async fn cancel_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            let evaluation = queries::evaluations::find(tx, id).await?;
            if evaluation.state.is_over() {
                return StoreError::conflict("the evaluation is over already");
            }
            run_completion::fail_evaluation(tx, id, Failure::Cancelled(reason)).await
        })
        .await
    }
}
