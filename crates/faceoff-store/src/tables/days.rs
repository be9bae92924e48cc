use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use faceoff_types::{StageDay, StageId};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// A day of a stage, from its cut on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Day {
    /// Whose, and whose label its seed has. An evaluation may outlast the date.
    pub of: StageDay,
    /// What the teams had active then plays the day, and nothing else.
    pub cut_at: Timestamp,
    /// When its last evaluation had ended: its seed is public from then on, its datasets and logs are
    /// their teams'. `None` before.
    pub released_at: Option<Timestamp>,
}

/// All days, the newest cut first, each with how many of its evaluations are finished.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<(Day, u32)>> {
    let rows = sqlx::query!(
        r#"SELECT d.stage_id AS "stage: Text<StageId>", d.day AS "day: Text<Date>", d.cut_at AS "cut_at: Instant",
                  d.released_at AS "released_at: Instant",
                  (SELECT COUNT(*) FROM evaluations e
                   WHERE e.stage_id = d.stage_id AND e.day = d.day AND e.state = 'finished'
                     AND e.voided_at IS NULL) AS "finished!: u32"
           FROM days d ORDER BY d.cut_at DESC, d.day DESC, d.stage_id"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| {
            let day = Day {
                of: StageDay {
                    stage: row.stage.0,
                    date: row.day.0,
                },
                cut_at: row.cut_at.0,
                released_at: row.released_at.map(|at| at.0),
            };
            (day, row.finished)
        })
        .collect())
}

/// The last day of a stage that had its cut.
pub(crate) async fn newest(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Option<Day>> {
    let id = Text(stage);
    let row = sqlx::query!(
        r#"SELECT day AS "day: Text<Date>", cut_at AS "cut_at: Instant",
                  released_at AS "released_at: Instant"
           FROM days WHERE stage_id = ? ORDER BY day DESC LIMIT 1"#,
        id
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(|row| Day {
        of: StageDay {
            stage,
            date: row.day.0,
        },
        cut_at: row.cut_at.0,
        released_at: row.released_at.map(|at| at.0),
    }))
}

/// Has the day had its cut?
pub(crate) async fn exists(connection: &mut SqliteConnection, of: StageDay) -> Result<bool> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM days WHERE stage_id = ? AND day = ?) AS "exists!: bool""#,
        stage,
        day
    )
    .fetch_one(connection)
    .await?)
}

/// Is the day released?
pub(crate) async fn is_released(connection: &mut SqliteConnection, of: StageDay) -> Result<bool> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM days WHERE stage_id = ? AND day = ? AND released_at IS NOT NULL)
                  AS "released!: bool""#,
        stage,
        day
    )
    .fetch_one(connection)
    .await?)
}

/// Adds a day with its cut. [`StoreError::DayHasCut`] if it has had it, or a later day has: a clock
/// that was set back starts nothing.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    of: StageDay,
    now: Timestamp,
) -> Result<()> {
    if let Some(newest) = newest(connection, of.stage).await?
        && newest.of.date >= of.date
    {
        return Err(StoreError::DayHasCut {
            day: newest.of.date,
            cut_at: newest.cut_at,
        });
    }
    let (stage, day, now) = (Text(of.stage), Text(of.date), Instant(now));
    sqlx::query!(
        "INSERT INTO days (stage_id, day, cut_at) VALUES (?, ?, ?)",
        stage,
        day,
        now
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Releases a day; false if it was released before.
pub(crate) async fn set_released(
    connection: &mut SqliteConnection,
    of: StageDay,
    now: Timestamp,
) -> Result<bool> {
    let (stage, day, now) = (Text(of.stage), Text(of.date), Instant(now));
    let released = sqlx::query!(
        "UPDATE days SET released_at = ? WHERE stage_id = ? AND day = ? AND released_at IS NULL",
        now,
        stage,
        day
    )
    .execute(connection)
    .await?;
    Ok(released.rows_affected() > 0)
}
