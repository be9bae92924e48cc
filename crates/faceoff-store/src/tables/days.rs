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
    /// What is not played by then is ended; `None`: however long it takes.
    pub deadline_at: Option<Timestamp>,
    /// When its last evaluation had ended: its seed is public from then on, its datasets and logs are
    /// their teams'. `None` before.
    pub released_at: Option<Timestamp>,
}

/// Why each of the days that were missed was played later than on its date.
pub(crate) async fn missed(connection: &mut SqliteConnection) -> Result<Vec<(StageDay, String)>> {
    let rows = sqlx::query!(
        r#"SELECT stage_id AS "stage: Text<StageId>", day AS "day: Text<Date>", missed_for AS "reason!"
           FROM days WHERE missed_for IS NOT NULL"#
    )
    .fetch_all(connection)
    .await?;
    let of = |stage: Text<StageId>, day: Text<Date>| StageDay {
        stage: stage.0,
        date: day.0,
    };
    Ok(rows
        .into_iter()
        .map(|row| (of(row.stage, row.day), row.reason))
        .collect())
}

/// All days, the newest cut first, each with how many of its evaluations are finished.
pub(crate) async fn all(connection: &mut SqliteConnection) -> Result<Vec<(Day, u32)>> {
    let rows = sqlx::query!(
        r#"SELECT d.stage_id AS "stage: Text<StageId>", d.day AS "day: Text<Date>", d.cut_at AS "cut_at: Instant",
                  d.deadline_at AS "deadline_at: Instant", d.released_at AS "released_at: Instant",
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
                deadline_at: row.deadline_at.map(|at| at.0),
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
                  deadline_at AS "deadline_at: Instant", released_at AS "released_at: Instant"
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
        deadline_at: row.deadline_at.map(|at| at.0),
        released_at: row.released_at.map(|at| at.0),
    }))
}

/// A day that had its cut; [`StoreError::NotFound`] if it had none.
pub(crate) async fn find(connection: &mut SqliteConnection, of: StageDay) -> Result<Day> {
    let (stage, day) = (Text(of.stage), Text(of.date));
    let row = sqlx::query!(
        r#"SELECT cut_at AS "cut_at: Instant", deadline_at AS "deadline_at: Instant",
                  released_at AS "released_at: Instant"
           FROM days WHERE stage_id = ? AND day = ?"#,
        stage,
        day
    )
    .fetch_optional(connection)
    .await?
    .ok_or(StoreError::NotFound("day"))?;
    Ok(Day {
        of,
        cut_at: row.cut_at.0,
        deadline_at: row.deadline_at.map(|at| at.0),
        released_at: row.released_at.map(|at| at.0),
    })
}

/// The days of a stage that had their cut and are not released, the earliest cut first.
pub(crate) async fn unreleased(
    connection: &mut SqliteConnection,
    stage: StageId,
) -> Result<Vec<Day>> {
    let id = Text(stage);
    let rows = sqlx::query!(
        r#"SELECT day AS "day: Text<Date>", cut_at AS "cut_at: Instant",
                  deadline_at AS "deadline_at: Instant"
           FROM days WHERE stage_id = ? AND released_at IS NULL ORDER BY cut_at, day"#,
        id
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| Day {
            of: StageDay {
                stage,
                date: row.day.0,
            },
            cut_at: row.cut_at.0,
            deadline_at: row.deadline_at.map(|at| at.0),
            released_at: None,
        })
        .collect())
}

/// The days that are past their deadline while something of them is neither played nor over.
pub(crate) async fn overdue(
    connection: &mut SqliteConnection,
    now: Timestamp,
) -> Result<Vec<StageDay>> {
    let now = Instant(now);
    let rows = sqlx::query!(
        r#"SELECT d.stage_id AS "stage: Text<StageId>", d.day AS "day: Text<Date>" FROM days d
           WHERE d.released_at IS NULL AND d.deadline_at <= ?
             AND EXISTS (SELECT 1 FROM evaluations e JOIN runs r ON r.id = e.run_id
                         WHERE e.stage_id = d.stage_id AND e.day = d.day AND e.state = 'open'
                           AND r.state <> 'played')
           ORDER BY d.cut_at"#,
        now
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| StageDay {
            stage: row.stage.0,
            date: row.day.0,
        })
        .collect())
}

/// Moves the deadline of a day.
pub(crate) async fn set_deadline(
    connection: &mut SqliteConnection,
    of: StageDay,
    deadline_at: Option<Timestamp>,
) -> Result<()> {
    let (stage, day, at) = (Text(of.stage), Text(of.date), deadline_at.map(Instant));
    sqlx::query!(
        "UPDATE days SET deadline_at = ? WHERE stage_id = ? AND day = ?",
        at,
        stage,
        day
    )
    .execute(connection)
    .await?;
    Ok(())
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

/// Adds a day with its cut and its deadline. [`StoreError::DayHasCut`] if it has had it, or a later day has: a clock
/// that was set back starts nothing.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    of: StageDay,
    deadline_at: Option<Timestamp>,
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
    let deadline_at = deadline_at.map(Instant);
    sqlx::query!(
        "INSERT INTO days (stage_id, day, cut_at, deadline_at) VALUES (?, ?, ?, ?)",
        stage,
        day,
        now,
        deadline_at
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Adds a missed day with its cut, on whatever date. [`StoreError::DayHasCut`] if it has had it.
pub(crate) async fn insert_missed(
    connection: &mut SqliteConnection,
    of: StageDay,
    deadline_at: Option<Timestamp>,
    reason: &str,
    now: Timestamp,
) -> Result<()> {
    match find(connection, of).await {
        Err(StoreError::NotFound(_)) => {}
        Ok(day) => {
            return Err(StoreError::DayHasCut {
                day: of.date,
                cut_at: day.cut_at,
            });
        }
        Err(error) => return Err(error),
    }
    let (stage, day, now) = (Text(of.stage), Text(of.date), Instant(now));
    let deadline_at = deadline_at.map(Instant);
    sqlx::query!(
        "INSERT INTO days (stage_id, day, cut_at, deadline_at, missed_for) VALUES (?, ?, ?, ?, ?)",
        stage,
        day,
        now,
        deadline_at,
        reason,
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
