//! The view `counting_evaluations`: the evaluations of days, without those of proposals (trials and proposed re-evaluations). In
//! spite of its name it also has evaluations that do not count: open and voided ones, and those that failed for another reason than
//! agent faults. This module reads the part of their state that organisers' decisions depend on, and stores these decisions.

use crate::{column::Instant, error::Result, tables::decision_records::DecisionRecord};
use faceoff_types::{EvaluationId, StageDay, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// The part of an evaluation's state that a decision depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EvaluationStatus {
    pub(crate) id: EvaluationId,
    pub(crate) is_open: bool,
    /// True if it finished, or failed by agent faults, and was not voided.
    pub(crate) counts: bool,
}

/// The evaluations of a day, or only those of one team.
pub(crate) async fn of_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    team: Option<TeamId>,
) -> Result<Vec<EvaluationStatus>> {
    Ok(sqlx::query_as!(
        EvaluationStatus,
        r#"SELECT id, state = 'open' AS "is_open!: bool",
                  state IN ('finished', 'agent_failed') AND voided_at IS NULL AS "counts!: bool"
           FROM counting_evaluations WHERE stage_id = ?1 AND day = ?2 AND (?3 IS NULL OR team_id = ?3) ORDER BY created_at, id"#,
        stage_day.stage,
        Text(stage_day.date),
        team
    )
    .fetch_all(connection)
    .await?)
}

/// The newest revision of its stage's rules with an evaluation on this day; `None` if there is no evaluation.
pub(crate) async fn revision_of_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
) -> Result<Option<u32>> {
    Ok(sqlx::query_scalar!(
        r#"SELECT MAX(revision) AS "revision: u32" FROM counting_evaluations WHERE stage_id = ? AND day = ?"#,
        stage_day.stage,
        Text(stage_day.date)
    )
    .fetch_one(connection)
    .await?)
}

/// The open evaluations of a day whose runs are not complete.
pub(crate) async fn incomplete_of_day(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
) -> Result<Vec<EvaluationId>> {
    Ok(sqlx::query_scalar!(
        "SELECT e.id
         FROM counting_evaluations e JOIN runs r ON r.id = e.run_id
         WHERE e.stage_id = ? AND e.day = ? AND e.state = 'open' AND r.state <> 'played'
         ORDER BY e.created_at, e.id",
        stage_day.stage,
        Text(stage_day.date)
    )
    .fetch_all(connection)
    .await?)
}

/// The open evaluations of a team.
pub(crate) async fn open_of_team(
    connection: &mut SqliteConnection,
    team: TeamId,
) -> Result<Vec<EvaluationId>> {
    Ok(sqlx::query_scalar!(
        "SELECT id
         FROM counting_evaluations WHERE team_id = ? AND state = 'open' ORDER BY created_at, id",
        team
    )
    .fetch_all(connection)
    .await?)
}

/// Voids an evaluation: it does not count any more.
pub(crate) async fn set_voided(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    decision: &DecisionRecord,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET voided_at = ?, voided_for = ? WHERE id = ?",
        Instant(decision.at),
        decision.reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Marks an evaluation's dataset as published.
pub(crate) async fn set_published(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<()> {
    sqlx::query!(
        "UPDATE evaluations SET published_at = ? WHERE id = ?",
        Instant(now),
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
