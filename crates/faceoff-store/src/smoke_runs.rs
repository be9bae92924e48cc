use crate::{
    Claim, Event, Store, StoreError,
    leases::{self, Hold},
};
use faceoff_types::{SmokeOutcome, SubmissionId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

/// Ends a submission's validation by our fault.
pub(crate) async fn give_up(
    connection: &mut SqliteConnection,
    unit: Uuid,
    submission: SubmissionId,
    reason: &str,
) -> Result<(), StoreError> {
    let (unit, submission) = (Text(unit), Text(submission));
    sqlx::query!(
        "UPDATE work_units SET state = 'dropped', nonce = NULL WHERE id = ?",
        unit
    )
    .execute(&mut *connection)
    .await?;
    sqlx::query!(
        "UPDATE submissions SET state = 'validation_error', reason = ? WHERE id = ?",
        reason,
        submission,
    )
    .execute(connection)
    .await?;
    Ok(())
}

impl Store {
    /// Stores what a smoke run found. Harmless when repeated by the same claim;
    /// [`StoreError::Conflict`] if the lease was lost.
    pub async fn commit_smoke(
        &self,
        claim: &Claim,
        outcome: SmokeOutcome,
        _now: Timestamp,
    ) -> Result<(), StoreError> {
        let mut tx = self.database.begin().await?;
        let unit = match leases::hold(&mut tx, claim).await? {
            Hold::Held(unit) if unit.kind == "smoke" => unit,
            Hold::Held(unit) => return Err(unit.other_than("smoke")),
            Hold::DoneBefore => return Ok(()),
            Hold::Lost => return Err(leases::lost()),
        };
        leases::mark_done(&mut tx, claim, 0).await?;
        let id = Text(unit.submission);
        let (state, agent_name, reason, log) = match outcome {
            SmokeOutcome::Valid { agent_name, log } => ("valid", Some(agent_name), None, log),
            SmokeOutcome::Invalid {
                agent_name,
                reason,
                log,
            } => ("invalid", agent_name, Some(reason), log),
        };
        sqlx::query!(
            "UPDATE submissions SET state = ?, agent_name = ?, reason = ?, log = ? WHERE id = ?",
            state,
            agent_name,
            reason,
            log,
            id,
        )
        .execute(&mut *tx)
        .await?;
        tx.commit().await?;
        self.signals.changed(Event::Submission(unit.submission));
        Ok(())
    }
}
