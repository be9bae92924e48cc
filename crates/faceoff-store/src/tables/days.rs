//! The table of evaluation days. A day starts with its cutoff and is released after its last evaluation.

use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{StageDay, StageId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// An evaluation day of a stage, from its cutoff on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Day {
    /// Stage and date; the day's seed derives from them. Evaluations may end after the date.
    pub stage_day: StageDay,
    /// The cutoff: the teams' active submissions at this time are evaluated.
    pub cutoff_at: Timestamp,
    /// Evaluations that are incomplete at this time are ended; `None`: no deadline.
    pub deadline_at: Option<Timestamp>,
    /// When the day was released; `None` before that. Since the release its seed is public, and the teams can download
    /// their datasets and logs.
    pub released_at: Option<Timestamp>,
}

/// A row of a statement that reads days.
struct DayRow {
    stage: StageId,
    day: Text<Date>,
    cutoff_at: Instant,
    deadline_at: Option<Instant>,
    released_at: Option<Instant>,
}

impl From<DayRow> for Day {
    fn from(row: DayRow) -> Self {
        Self {
            stage_day: StageDay {
                stage: row.stage,
                date: row.day.0,
            },
            cutoff_at: row.cutoff_at.0,
            deadline_at: row.deadline_at.map(|at| at.0),
            released_at: row.released_at.map(|at| at.0),
        }
    }
}

/// `SELECT` of days; the argument is the SQL after `FROM days`.
macro_rules! select_days {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            DayRow,
            "SELECT stage_id AS stage, day, cutoff_at, deadline_at, released_at FROM days " + $tail
            $(, $argument)*
        )
    };
}

/// The days that were started later than on their date, each with the reason.
pub(crate) async fn missed(connection: &mut SqliteConnection) -> Result<Vec<(StageDay, String)>> {
    let rows = sqlx::query!(
        r#"SELECT stage_id AS stage, day, missed_for AS "reason!"
           FROM days WHERE missed_for IS NOT NULL"#
    )
    .fetch_all(connection)
    .await?;
    let stage_day = |stage: StageId, day: Text<Date>| StageDay { stage, date: day.0 };
    Ok(rows
        .into_iter()
        .map(|row| (stage_day(row.stage, row.day), row.reason))
        .collect())
}

/// All days, the newest cutoff first, each with the number of its finished evaluations.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<(Day, u32)>> {
    let rows = sqlx::query!(
        r#"SELECT d.stage_id AS stage, d.day, d.cutoff_at,
                  d.deadline_at, d.released_at,
                  (SELECT COUNT(*) FROM counting_evaluations e
                   WHERE e.stage_id = d.stage_id AND e.day = d.day AND e.state = 'finished'
                     AND e.voided_at IS NULL) AS "finished!: u32"
           FROM days d ORDER BY d.cutoff_at DESC, d.day DESC, d.stage_id"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| {
            let day = Day {
                stage_day: StageDay {
                    stage: row.stage,
                    date: row.day.0,
                },
                cutoff_at: row.cutoff_at.0,
                deadline_at: row.deadline_at.map(|at| at.0),
                released_at: row.released_at.map(|at| at.0),
            };
            (day, row.finished)
        })
        .collect())
}

/// The newest day of a stage.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<Day>> {
    let row = select_days!("WHERE stage_id = ? ORDER BY day DESC LIMIT 1", stage)
        .fetch_optional(connection)
        .await?;
    Ok(row.map(Day::from))
}

/// The newest day of a stage that blocks dates before it: each day is after all others, so that none is started twice after
/// a clock was set back. A day after `today` exists only because a clock was ahead; it is ignored if nothing of it counts.
pub(crate) async fn newest_blocking(
    connection: &mut SqliteConnection,
    stage: StageId,
    today: Date,
) -> Result<Option<Day>> {
    let row = select_days!(
        "WHERE stage_id = ?1 AND (day <= ?2 OR EXISTS (
             SELECT 1 FROM counting_evaluations e WHERE e.stage_id = ?1 AND e.day = days.day
             AND (e.state = 'open' OR e.state IN ('finished', 'agent_failed') AND e.voided_at IS NULL)))
         ORDER BY day DESC LIMIT 1",
        stage,
        Text(today)
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(Day::from))
}

/// The day; [`StoreError::NotFound`] if its cutoff has not passed.
pub(crate) async fn find(connection: &mut SqliteConnection, stage_day: StageDay) -> Result<Day> {
    select_days!(
        "WHERE stage_id = ? AND day = ?",
        stage_day.stage,
        Text(stage_day.date)
    )
    .fetch_optional(connection)
    .await?
    .map(Day::from)
    .ok_or(StoreError::NotFound("day"))
}

/// The unreleased days of a stage, the earliest cutoff first.
pub(crate) async fn unreleased(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Vec<Day>> {
    let rows = select_days!(
        "WHERE stage_id = ? AND released_at IS NULL ORDER BY cutoff_at, day",
        stage
    )
    .fetch_all(connection)
    .await?;
    Ok(rows.into_iter().map(Day::from).collect())
}

/// The days with incomplete evaluations whose deadline has passed.
pub(crate) async fn overdue(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<Vec<StageDay>> {
    let rows = sqlx::query!(
        "SELECT d.stage_id AS stage, d.day FROM days d
         WHERE d.released_at IS NULL AND d.deadline_at <= ?
           AND EXISTS (SELECT 1 FROM counting_evaluations e JOIN runs r ON r.id = e.run_id
                       WHERE e.stage_id = d.stage_id AND e.day = d.day AND e.state = 'open'
                         AND r.state <> 'played')
         ORDER BY d.cutoff_at",
        Instant(now)
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| StageDay {
            stage: row.stage,
            date: row.day.0,
        })
        .collect())
}

/// Moves the deadline of a day.
pub(crate) async fn set_deadline(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    deadline_at: Option<Timestamp>,
) -> Result<()> {
    sqlx::query!(
        "UPDATE days SET deadline_at = ? WHERE stage_id = ? AND day = ?",
        deadline_at.map(Instant),
        stage_day.stage,
        Text(stage_day.date)
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Has the day's cutoff passed?
pub(crate) async fn exists(connection: &mut SqliteConnection, stage_day: StageDay) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM days WHERE stage_id = ? AND day = ?) AS "exists!: bool""#,
        stage_day.stage,
        Text(stage_day.date)
    )
    .fetch_one(connection)
    .await?)
}

/// Adds a day whose cutoff is now. [`StoreError::CutoffPassed`] if the day, or a later one with counting evaluations, exists.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    deadline_at: Option<Timestamp>,
    now: Timestamp,
) -> Result<()> {
    if let Some(newest) = newest_blocking(connection, stage_day.stage, stage_day.date).await?
        && newest.stage_day.date >= stage_day.date
    {
        return Err(StoreError::CutoffPassed {
            day: newest.stage_day.date,
            cutoff_at: newest.cutoff_at,
        });
    }
    sqlx::query!(
        "INSERT INTO days (stage_id, day, cutoff_at, deadline_at) VALUES (?, ?, ?, ?)",
        stage_day.stage,
        Text(stage_day.date),
        Instant(now),
        deadline_at.map(Instant)
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Adds a missed day of any date, whose cutoff is now. [`StoreError::CutoffPassed`] if the day exists.
pub(crate) async fn insert_missed(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    deadline_at: Option<Timestamp>,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    match find(connection, stage_day).await {
        Err(StoreError::NotFound(_)) => {}
        Ok(day) => {
            return Err(StoreError::CutoffPassed {
                day: stage_day.date,
                cutoff_at: day.cutoff_at,
            });
        }
        Err(error) => return Err(error),
    }
    sqlx::query!(
        "INSERT INTO days (stage_id, day, cutoff_at, deadline_at, missed_for) VALUES (?, ?, ?, ?, ?)",
        stage_day.stage,
        Text(stage_day.date),
        Instant(now),
        deadline_at.map(Instant),
        reason,
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Releases a day; false if it was released before.
pub(crate) async fn set_released(
    connection: &mut SqliteConnection,
    stage_day: StageDay,
    now: Timestamp,
) -> Result<bool> {
    let released = sqlx::query!(
        "UPDATE days SET released_at = ? WHERE stage_id = ? AND day = ? AND released_at IS NULL",
        Instant(now),
        stage_day.stage,
        Text(stage_day.date)
    )
    .execute(connection)
    .await?;
    Ok(released.rows_affected() > 0)
}
