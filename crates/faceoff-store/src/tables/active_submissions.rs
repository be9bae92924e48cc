//! What each team enters at the next cut.

use crate::{column::Instant, error::Result};
use faceoff_types::{SubmissionId, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// Makes a submission that turned valid its team's active one. False if that has a newer one, or has
/// chosen one since this was uploaded.
pub(crate) async fn put_newest(
    connection: &mut SqliteConnection,
    team: TeamId,
    submission: SubmissionId,
    uploaded_at: Timestamp,
) -> Result<bool> {
    let (team, submission, since) = (Text(team), Text(submission), Instant(uploaded_at));
    let put = sqlx::query!(
        "INSERT INTO active_submissions (team_id, submission_id, since) VALUES (?, ?, ?)
         ON CONFLICT (team_id) DO UPDATE SET submission_id = excluded.submission_id, since = excluded.since
         WHERE excluded.since >= active_submissions.since",
        team,
        submission,
        since,
    )
    .execute(connection)
    .await?;
    Ok(put.rows_affected() > 0)
}

/// Makes a submission its team's active one by choice: what is uploaded from now on takes its place.
pub(crate) async fn choose(
    connection: &mut SqliteConnection,
    team: TeamId,
    submission: SubmissionId,
    now: Timestamp,
) -> Result<()> {
    let (team, submission, now) = (Text(team), Text(submission), Instant(now));
    sqlx::query!(
        "INSERT OR REPLACE INTO active_submissions (team_id, submission_id, since) VALUES (?, ?, ?)",
        team,
        submission,
        now,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Its team has none active any more, if it was this one.
pub(crate) async fn remove(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<()> {
    let submission = Text(submission);
    sqlx::query!(
        "DELETE FROM active_submissions WHERE submission_id = ?",
        submission
    )
    .execute(connection)
    .await?;
    Ok(())
}
