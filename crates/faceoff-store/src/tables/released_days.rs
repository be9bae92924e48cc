//! Days whose seed has left the server.

use crate::{column::Instant, error::Result};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};

/// When the first dataset of the day was handed out.
pub(crate) async fn released_at(
    connection: &mut SqliteConnection,
    day: Date,
) -> Result<Option<Timestamp>> {
    let day = Text(day);
    let released = sqlx::query_scalar!(
        r#"SELECT released_at AS "at: Instant" FROM released_days WHERE day = ?"#,
        day
    )
    .fetch_optional(connection)
    .await?;
    Ok(released.map(|at| at.0))
}

pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    day: Date,
    now: Timestamp,
) -> Result<()> {
    let (day, now) = (Text(day), Instant(now));
    sqlx::query!(
        "INSERT INTO released_days (day, released_at) VALUES (?, ?)",
        day,
        now
    )
    .execute(connection)
    .await?;
    Ok(())
}
