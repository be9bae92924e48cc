use crate::{Store, StoreError};
use faceoff_types::EvaluationId;
use sqlx::types::Text;

impl Store {
    /// The episode summary of an evaluation, as it was stored under `version`; `None` if there is
    /// none of that version.
    pub async fn episode_summary(
        &self,
        evaluation: EvaluationId,
        version: u32,
    ) -> Result<Option<String>, StoreError> {
        let evaluation = Text(evaluation);
        Ok(sqlx::query_scalar!(
            "SELECT summary FROM episode_summaries WHERE evaluation_id = ? AND version = ?",
            evaluation,
            version,
        )
        .fetch_optional(&self.database.read)
        .await?)
    }

    /// Keeps the episode summary (JSON) of an evaluation, in place of an earlier one.
    pub async fn keep_episode_summary(
        &self,
        evaluation: EvaluationId,
        version: u32,
        summary: &str,
    ) -> Result<(), StoreError> {
        let evaluation = Text(evaluation);
        let mut tx = self.database.begin().await?;
        sqlx::query!(
            "INSERT INTO episode_summaries (evaluation_id, version, summary) VALUES (?, ?, ?)
             ON CONFLICT (evaluation_id) DO UPDATE SET version = excluded.version, summary = excluded.summary",
            evaluation,
            version,
            summary,
        )
        .execute(&mut *tx)
        .await?;
        Ok(tx.commit().await?)
    }
}
