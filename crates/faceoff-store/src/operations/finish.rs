use crate::{
    boxed,
    error::Result,
    event::{Event, Subject},
    operations::{
        commit::{Committed, other_work},
        drafts as draft_ends,
        purpose::Purpose,
        release_day,
    },
    queue::Claim,
    store::Store,
    tables::{drafts, evaluations, retentions},
};
use faceoff_types::EvaluationResult;
use jiff::Timestamp;

impl Store {
    /// Stores the score, the dataset's artifact key with the BLAKE3 of its archive (64 hexadecimal
    /// digits), and the end in one transaction, with the release of the day if this was its last
    /// evaluation. Idempotent, as [`Store::commit_shard`] is. After
    /// [`StoreError::Database`](crate::StoreError::Database) the dataset may be the evaluation's: leave it.
    #[boxed]
    pub async fn finish_evaluation(
        &self,
        claim: &Claim,
        result: &EvaluationResult,
        dataset: &str,
        dataset_blake3: &str,
        now: Timestamp,
    ) -> Result<Committed> {
        let bytes = self.artifacts().bytes_of(dataset).await?;
        self.commit(claim, now, async |tx, purpose| match purpose {
            Purpose::Finalise(id) => {
                evaluations::set_finished(tx, id, result, dataset, dataset_blake3, now).await?;
                if let Some(bytes) = bytes {
                    retentions::set_measured(tx, id, bytes).await?;
                }
                let event = Event::EvaluationFinished {
                    score: result.score,
                    dataset_blake3: dataset_blake3.to_owned(),
                };
                tx.record(Subject::Evaluation(id), event);
                release_day::if_over(tx, id).await
            }
            Purpose::FinaliseDraft { id, proposal, .. } => {
                drafts::set_finished(tx, id, result, dataset, dataset_blake3, now).await?;
                if let Some(bytes) = bytes {
                    retentions::set_measured(tx, id, bytes).await?;
                }
                draft_ends::tell_if_over(tx, proposal).await
            }
            other => Err(other_work("finalisation", &other)),
        })
        .await
    }
}
