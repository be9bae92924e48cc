//! The ways in which an evaluation ends, and what is cleared away afterwards.

use crate::{
    Claim, Event, Store, StoreError,
    column::{Instant, Json},
    leases::{self, Hold},
    shards,
};
use faceoff_types::{AgentFault, EpisodeOutcome, EvaluationId, EvaluationResult, Task};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// How much of its agent's standard error a failed evaluation keeps, bytes; the protocol's bound for
/// one run.
const LOG_TAIL_BYTES: usize = 64 * 1024;

/// Takes an evaluation's units that are not done out of the queue; their workers lose the lease.
async fn drop_open_units(
    connection: &mut SqliteConnection,
    id: EvaluationId,
) -> Result<(), StoreError> {
    let id = Text(id);
    sqlx::query!(
        "UPDATE work_units SET state = 'dropped', nonce = NULL
         WHERE evaluation_id = ? AND state IN ('queued', 'leased')",
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends an evaluation by the agent's faults, as found in the committed shards.
pub(crate) async fn fail_agent(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<(), StoreError> {
    drop_open_units(connection, id).await?;
    let id = Text(id);
    let faulty = sqlx::query!(
        r#"SELECT task AS "task: Text<Task>", first_episode AS "first_episode: u32",
                  outcomes AS "outcomes!: Json<Vec<EpisodeOutcome>>", log AS "log!"
           FROM shards WHERE evaluation_id = ? AND agent_faults > 0 ORDER BY position"#,
        id,
    )
    .fetch_all(&mut *connection)
    .await?;
    let mut faults: Vec<AgentFault> = Vec::new();
    let mut log = String::new();
    for shard in faulty {
        faults.extend(
            shard
                .outcomes
                .0
                .into_iter()
                .filter_map(|outcome| outcome.fault),
        );
        if !shard.log.is_empty() {
            log.push_str(&format!(
                "== {} from episode {} ==\n",
                shard.task.0, shard.first_episode
            ));
            log.push_str(shard.log.trim_end());
            log.push('\n');
        }
    }
    let (faults, now, log) = (Json(faults), Instant(now), tail(&log, LOG_TAIL_BYTES));
    sqlx::query!(
        "UPDATE evaluations SET state = 'agent_failed', finished_at = ?, faults = ?, log = ?
         WHERE id = ?",
        now,
        faults,
        log,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Ends an evaluation by our fault; the state gives the day's turn back.
pub(crate) async fn fail_platform(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    reason: &str,
    now: Timestamp,
) -> Result<(), StoreError> {
    drop_open_units(connection, id).await?;
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE evaluations SET state = 'platform_failed', finished_at = ?, reason = ? WHERE id = ?",
        now,
        reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// The last `bytes` bytes, or a little less: no character is cut.
fn tail(text: &str, bytes: usize) -> &str {
    let mut start = text.len().saturating_sub(bytes);
    while !text.is_char_boundary(start) {
        start += 1;
    }
    &text[start..]
}

impl Store {
    /// Stores the score, the dataset's artifact key and the end in one transaction. Harmless when
    /// repeated by the same claim; [`StoreError::Conflict`] if the lease was lost.
    pub async fn finish_evaluation(
        &self,
        claim: &Claim,
        result: &EvaluationResult,
        dataset: &str,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        let unit = match leases::hold(&mut tx, claim).await? {
            Hold::Held(unit) => unit,
            Hold::DoneBefore => return Ok(()),
            Hold::Lost => return Err(leases::lost()),
        };
        let evaluation = unit.evaluation_of("finalise")?;
        leases::mark_done(&mut tx, claim, 0).await?;
        let (id, result, now) = (Text(evaluation), Json(result), Instant(now));
        sqlx::query!(
            "UPDATE evaluations SET state = 'finished', finished_at = ?, result = ?, dataset = ?
             WHERE id = ?",
            now,
            result,
            dataset,
            id,
        )
        .execute(&mut *tx)
        .await?;
        tx.commit().await?;
        self.signals.changed(Event::Evaluation(evaluation));
        Ok(())
    }

    /// Stops an evaluation that is not over and gives the day's turn back. Workers that play its
    /// shards learn of it at their next heartbeat.
    pub async fn cancel_evaluation(
        &self,
        id: EvaluationId,
        reason: &str,
        now: Timestamp,
    ) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        if crate::evaluations::find(&mut tx, id).await?.state.is_over() {
            return Err(StoreError::Conflict(
                "the evaluation is over already".into(),
            ));
        }
        drop_open_units(&mut tx, id).await?;
        let (id_text, now) = (Text(id), Instant(now));
        sqlx::query!(
            "UPDATE evaluations SET state = 'cancelled', finished_at = ?, reason = ? WHERE id = ?",
            now,
            reason,
            id_text,
        )
        .execute(&mut *tx)
        .await?;
        tx.commit().await?;
        self.signals.changed(Event::Evaluation(id));
        Ok(())
    }

    /// Removes the shard recordings of evaluations that are over: a finished one has them in its
    /// dataset, the others need them no more. Returns of how many evaluations. Run it now and then;
    /// a kill half way is made up for by the next run.
    pub async fn remove_old_recordings(&self, now: Timestamp) -> Result<usize, StoreError> {
        let over = sqlx::query_scalar!(
            r#"SELECT id AS "id: Text<EvaluationId>" FROM evaluations
               WHERE finished_at IS NOT NULL AND recordings_removed_at IS NULL"#
        )
        .fetch_all(&self.database.read)
        .await?;
        let now = Instant(now);
        for id in &over {
            self.artifacts()
                .delete_folder(&shards::recordings_of(id.0))
                .await?;
            let mut tx = self.database.begin().await?;
            sqlx::query!(
                "UPDATE evaluations SET recordings_removed_at = ? WHERE id = ?",
                now,
                id
            )
            .execute(&mut *tx)
            .await?;
            tx.commit().await?;
        }
        Ok(over.len())
    }
}

#[cfg(test)]
mod tests {
    use super::tail;

    #[test]
    fn a_log_is_cut_between_characters() {
        assert_eq!(tail("abc", 5), "abc");
        assert_eq!(tail("abc", 2), "bc");
        assert_eq!(tail("aéb", 2), "b");
        assert_eq!(tail("", 2), "");
    }
}
