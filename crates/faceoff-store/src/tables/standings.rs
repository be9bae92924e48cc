//! Evaluations as rulings see them: which are under way, which count, and which count no more.

use crate::{column::Instant, error::Result, tables::rulings::Ruling};
use faceoff_types::{EvaluationId, RunId, StageDay, TeamId};
use jiff::Timestamp;
use sqlx::{SqliteConnection, types::Text};

/// How an evaluation stands to a ruling.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    pub(crate) id: EvaluationId,
    pub(crate) run: RunId,
    pub(crate) is_open: bool,
    /// It has ended by the agent's doing, and counts.
    pub(crate) counts: bool,
}

/// How the evaluations of a day stand.
pub(crate) async fn of_day(
    connection: &mut SqliteConnection,
    of: StageDay,
) -> Result<Vec<Standing>> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    let rows = sqlx::query!(
        r#"SELECT id AS "id: Text<EvaluationId>", run_id AS "run: Text<RunId>",
                  state = 'open' AS "is_open!: bool",
                  state IN ('finished', 'agent_failed') AND voided_at IS NULL AS "counts!: bool"
           FROM evaluations WHERE stage_id = ? AND day = ? ORDER BY created_at, id"#,
        stage,
        day
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| Standing {
            id: row.id.0,
            run: row.run.0,
            is_open: row.is_open,
            counts: row.counts,
        })
        .collect())
}

/// How a team's evaluations of a day stand.
pub(crate) async fn of_day_and_team(
    connection: &mut SqliteConnection,
    of: StageDay,
    team: TeamId,
) -> Result<Vec<Standing>> {
    let (stage, day, team) = (Text(of.stage), Text(of.date), Text(team));
    let rows = sqlx::query!(
        r#"SELECT id AS "id: Text<EvaluationId>", run_id AS "run: Text<RunId>",
                  state = 'open' AS "is_open!: bool",
                  state IN ('finished', 'agent_failed') AND voided_at IS NULL AS "counts!: bool"
           FROM evaluations WHERE stage_id = ? AND day = ? AND team_id = ? ORDER BY created_at, id"#,
        stage,
        day,
        team
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| Standing {
            id: row.id.0,
            run: row.run.0,
            is_open: row.is_open,
            counts: row.counts,
        })
        .collect())
}

/// The newest of its stage's rules that a day was played by; `None` if nobody played it.
pub(crate) async fn revision_of_day(
    connection: &mut SqliteConnection,
    of: StageDay,
) -> Result<Option<u32>> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    Ok(sqlx::query_scalar!(
        r#"SELECT MAX(revision) AS "revision: u32" FROM evaluations WHERE stage_id = ? AND day = ?"#,
        stage,
        day
    )
    .fetch_one(connection)
    .await?)
}

/// Which evaluations of a day are neither over nor played and waiting for their score.
pub(crate) async fn unplayed_of_day(
    connection: &mut SqliteConnection,
    of: StageDay,
) -> Result<Vec<(EvaluationId, RunId)>> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    let rows = sqlx::query!(
        r#"SELECT e.id AS "id: Text<EvaluationId>", e.run_id AS "run: Text<RunId>"
           FROM evaluations e JOIN runs r ON r.id = e.run_id
           WHERE e.stage_id = ? AND e.day = ? AND e.state = 'open' AND r.state <> 'played'
           ORDER BY e.created_at, e.id"#,
        stage,
        day
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id.0, row.run.0)).collect())
}

/// Which evaluations of a team are not over.
pub(crate) async fn open_of_team(
    connection: &mut SqliteConnection,
    team: TeamId,
) -> Result<Vec<(EvaluationId, RunId)>> {
    let team = Text(team);
    let rows = sqlx::query!(
        r#"SELECT id AS "id: Text<EvaluationId>", run_id AS "run: Text<RunId>"
           FROM evaluations WHERE team_id = ? AND state = 'open' ORDER BY created_at, id"#,
        team
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(|row| (row.id.0, row.run.0)).collect())
}

/// From now on it does not count.
pub(crate) async fn set_voided(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    ruling: &Ruling,
) -> Result<()> {
    let (id, at) = (Text(id), Instant(ruling.at));
    sqlx::query!(
        "UPDATE evaluations SET voided_at = ?, voided_for = ? WHERE id = ?",
        at,
        ruling.reason,
        id,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// From now on its dataset is for everybody.
pub(crate) async fn set_published(
    connection: &mut SqliteConnection,
    id: EvaluationId,
    now: Timestamp,
) -> Result<()> {
    let (id, now) = (Text(id), Instant(now));
    sqlx::query!(
        "UPDATE evaluations SET published_at = ? WHERE id = ?",
        now,
        id
    )
    .execute(connection)
    .await?;
    Ok(())
}
