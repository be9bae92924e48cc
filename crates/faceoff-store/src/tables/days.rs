use crate::{
    column::Instant,
    error::{Result, StoreError},
};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// A UTC day of the competition, from its cut on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Day {
    /// Whose label its seed has. An evaluation may outlast it.
    pub date: Date,
    /// What the teams had active then plays the day, and nothing else.
    pub cut_at: Timestamp,
    /// When its last evaluation had ended: its seed is public from then on, its datasets and logs are
    /// their teams'. `None` before.
    pub released_at: Option<Timestamp>,
}

/// All days, the newest first, each with how many of its evaluations are finished.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<(Day, u32)>> {
    let rows = sqlx::query!(
        r#"SELECT d.day AS "day: Text<Date>", d.cut_at AS "cut_at: Instant",
                  d.released_at AS "released_at: Instant",
                  (SELECT COUNT(*) FROM evaluations e
                   WHERE e.day = d.day AND e.state = 'finished') AS "finished!: u32"
           FROM days d ORDER BY d.day DESC"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| {
            let day = Day {
                date: row.day.0,
                cut_at: row.cut_at.0,
                released_at: row.released_at.map(|at| at.0),
            };
            (day, row.finished)
        })
        .collect())
}

/// The last day that had its cut.
pub(crate) async fn newest(connection: &mut SqliteConnection) -> Result<Option<Day>> {
    let row = sqlx::query!(
        r#"SELECT day AS "day: Text<Date>", cut_at AS "cut_at: Instant",
                  released_at AS "released_at: Instant"
           FROM days ORDER BY day DESC LIMIT 1"#
    )
    .fetch_optional(connection)
    .await?;
    Ok(row.map(|row| Day {
        date: row.day.0,
        cut_at: row.cut_at.0,
        released_at: row.released_at.map(|at| at.0),
    }))
}

/// Is the day released?
pub(crate) async fn is_released(connection: &mut SqliteConnection, day: Date) -> Result<bool> {
    let day = Text(day);
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM days WHERE day = ? AND released_at IS NOT NULL)
                  AS "released!: bool""#,
        day
    )
    .fetch_one(connection)
    .await?)
}

/// Adds a day with its cut. [`StoreError::DayHasCut`] if it has had it, or a later day has: a clock
/// that was set back starts nothing.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    date: Date,
    now: Timestamp,
) -> Result<()> {
    if let Some(newest) = newest(connection).await?
        && newest.date >= date
    {
        return Err(StoreError::DayHasCut {
            day: newest.date,
            cut_at: newest.cut_at,
        });
    }
    let (day, now) = (Text(date), Instant(now));
    sqlx::query!("INSERT INTO days (day, cut_at) VALUES (?, ?)", day, now)
        .execute(connection)
        .await?;
    Ok(())
}

/// Releases a day; false if it was released before.
pub(crate) async fn set_released(
    connection: &mut SqliteConnection,
    day: Date,
    now: Timestamp,
) -> Result<bool> {
    let (day, now) = (Text(day), Instant(now));
    let released = sqlx::query!(
        "UPDATE days SET released_at = ? WHERE day = ? AND released_at IS NULL",
        now,
        day
    )
    .execute(connection)
    .await?;
    Ok(released.rows_affected() > 0)
}
