//! The table of active submissions: for each team the one that is evaluated at the next cutoff.

use crate::{column::Instant, error::Result};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::SqliteConnection;

/// Makes a submission that passed its validation its team's active one. Returns false if the team has a newer
/// submission, or has chosen one since this upload.
pub(crate) async fn activate_unless_superseded(
    connection: &mut SqliteConnection,
    team: TeamId,
    submission: SubmissionId,
    uploaded_at: Timestamp,
) -> Result<bool> {
    let put = sqlx::query!(
        "INSERT INTO active_submissions (team_id, submission_id, since) VALUES (?, ?, ?)
         ON CONFLICT (team_id) DO UPDATE SET submission_id = excluded.submission_id, since = excluded.since
         WHERE excluded.since >= active_submissions.since",
        team,
        submission,
        Instant(uploaded_at),
    )
    .execute(connection)
    .await?;
    Ok(put.rows_affected() > 0)
}

/// Makes a submission its team's active one by choice. Later uploads replace it.
pub(crate) async fn choose(
    connection: &mut SqliteConnection,
    team: TeamId,
    submission: SubmissionId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "INSERT OR REPLACE INTO active_submissions (team_id, submission_id, since) VALUES (?, ?, ?)",
        team,
        submission,
        Instant(now),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Makes a submission inactive, if it was active.
pub(crate) async fn remove(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<()> {
    sqlx::query!(
        "DELETE FROM active_submissions WHERE submission_id = ?",
        submission
    )
    .execute(connection)
    .await?;
    Ok(())
}
