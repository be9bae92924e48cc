use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    reads,
    store::Store,
    tables::{
        evaluations::{Evaluation, EvaluationState},
        stages, standings,
    },
};
use faceoff_types::EvaluationId;
use jiff::Timestamp;

impl Store {
    /// Makes an evaluation and its dataset public before its stage does; once that is done it stays.
    /// [`StoreError::Conflict`] unless it is finished, its day is released and its stage is not blind.
    #[boxed]
    pub async fn publish_evaluation(
        &self,
        actor: Actor,
        id: EvaluationId,
        now: Timestamp,
    ) -> Result<Evaluation> {
        self.write(actor, now, async |tx| {
            let found = reads::evaluations::find(tx, id).await?;
            let stage = stages::find(tx, found.of.stage).await?;
            let refused = |why: &str| Err(StoreError::Conflict(why.to_owned()));
            if !matches!(found.state, EvaluationState::Finished { .. }) {
                return refused("only a finished evaluation has a dataset to publish");
            }
            if stage.settings.blind {
                return refused(
                    "the stage is blind: nothing of it is published before the organiser opens it",
                );
            }
            if found.released_at.is_none() {
                return refused(
                    "others of the day are still playing the same episodes: the dataset can be published once the day \
                     is released",
                );
            }
            if found.published_at.is_none() {
                standings::set_published(tx, id, now).await?;
                tx.record(Subject::Evaluation(id), Event::EvaluationPublished);
            }
            reads::evaluations::find(tx, id).await
        })
        .await
    }
}
