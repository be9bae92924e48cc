use crate::{Evaluation, EvaluationPlan, Store, StoreError, evaluations, season};
use jiff::{Timestamp, civil::Date};
use sqlx::types::Text;

impl Store {
    /// The last UTC day that the daily schedule has started; `None` before the first.
    pub async fn last_scheduled_day(&self) -> Result<Option<Date>, StoreError> {
        let day =
            sqlx::query_scalar!(r#"SELECT last_scheduled_day AS "day: Text<Date>" FROM season"#)
                .fetch_one(&self.database.read)
                .await?;
        Ok(day.map(|day| day.0))
    }

    /// Starts `now`'s UTC day once, whoever asks and however often: the note that the day was started
    /// and its evaluations are one transaction. `None` if the schedule has started it before, or
    /// the season is closed.
    pub async fn start_scheduled_day(
        &self,
        plan: &EvaluationPlan,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>, StoreError> {
        let day = Text(evaluations::utc_day(now));
        let mut tx = self.database.begin().await?;
        if season::closed_at(&mut tx).await?.is_some() {
            return Ok(None);
        }
        // ISO dates sort as text
        let noted = sqlx::query!(
            "UPDATE season SET last_scheduled_day = ?1
             WHERE last_scheduled_day IS NULL OR last_scheduled_day < ?1",
            day,
        )
        .execute(&mut *tx)
        .await?;
        if noted.rows_affected() == 0 {
            return Ok(None);
        }
        let started = evaluations::start_teams(&mut tx, plan, now).await?;
        tx.commit().await?;
        self.announce(&started);
        Ok(Some(started))
    }
}
