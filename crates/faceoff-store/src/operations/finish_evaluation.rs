//! End of a scoring job: an evaluation gets its score and its dataset.

use crate::{
    boxed_future,
    error::Result,
    event::{Event, Subject},
    operations::{
        commit_job::{CommitOutcome, wrong_job},
        job_purpose::JobPurpose,
        release_day, run_completion,
    },
    queue::JobClaim,
    store::Store,
    tables::{evaluation_runs::EvaluationRun, evaluations, retentions},
};
use faceoff_types::EvaluationResult;
use jiff::Timestamp;

impl Store {
    /// Stores the score and the dataset's artifact key with the BLAKE3 of its archive (64 hexadecimal
    /// digits), and ends the evaluation, in one transaction. If it was the last of its day, the day is
    /// released. Idempotent, as [`Store::commit_shard`] is. After
    /// [`StoreError::Database`](crate::StoreError::Database) the database may already refer to the dataset: do not
    /// delete it.
    #[boxed_future]
    pub async fn finish_evaluation(
        &self,
        claim: &JobClaim,
        result: &EvaluationResult,
        dataset: &str,
        dataset_blake3: &str,
        now: Timestamp,
    ) -> Result<CommitOutcome> {
        let dataset_bytes = self.artifacts().size_bytes(dataset).await?;
        self.commit(claim, now, async |tx, purpose| match purpose {
            JobPurpose::Scoring(EvaluationRun { id, proposal, .. }) => {
                evaluations::set_finished(tx, id, result, dataset, dataset_blake3, now).await?;
                if let Some(dataset_bytes) = dataset_bytes {
                    retentions::set_dataset_bytes(tx, id, dataset_bytes).await?;
                }
                if let Some(proposal) = proposal {
                    return run_completion::record_proposal_end(tx, proposal).await;
                }
                let event = Event::EvaluationFinished {
                    score: result.score,
                    dataset_blake3: dataset_blake3.to_owned(),
                };
                tx.record(Subject::Evaluation(id), event);
                release_day::release_if_over(tx, id).await
            }
            other => Err(wrong_job("scoring job", &other)),
        })
        .await
    }
}
