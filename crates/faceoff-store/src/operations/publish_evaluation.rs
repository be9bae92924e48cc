//! Publication of an evaluation and its dataset by its team, before the stage does it automatically.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    queries,
    store::Store,
    tables::{
        counting_evaluations,
        evaluations::{Evaluation, EvaluationState},
        stages,
    },
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;

impl Store {
    /// Publishes an evaluation and its dataset earlier than its stage's settings do. This cannot be undone.
    /// [`StoreError::Conflict`] unless it is finished, its day is released and its stage is not blind (its scores are not hidden).
    #[boxed_future]
    pub async fn publish_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            let evaluation = queries::evaluations::find(tx, id).await?;
            let stage = stages::find(tx, evaluation.stage_day.stage).await?;
            if !matches!(evaluation.state, EvaluationState::Finished { .. }) {
                return StoreError::conflict("only a finished evaluation has a dataset to publish");
            }
            if stage.settings.blind {
                return StoreError::conflict(
                    "the stage is blind: no dataset is published before an organiser reveals the stage",
                );
            }
            if evaluation.released_at.is_none() {
                return StoreError::conflict(
                    "other evaluations of the day are still running the same episodes: the dataset can be published \
                     once the day is released",
                );
            }
            if evaluation.published_at.is_none() {
                counting_evaluations::set_published(tx, id, now).await?;
                tx.record(Subject::Evaluation(id), Event::EvaluationPublished);
            }
            queries::evaluations::find(tx, id).await
        })
        .await
    }
}
