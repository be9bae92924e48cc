//! When a day's seed may leave the server.
//!
//! All evaluations of a day play the same episodes, and their datasets carry the seed that makes them.
//! So datasets are held back until no evaluation of the day is under way, and once one has been
//! handed out, nothing that was uploaded later plays that day.

use crate::{Store, StoreError, column::Instant, evaluations, season};
use jiff::{Timestamp, civil::Date};
use sqlx::{SqliteConnection, types::Text};
use std::collections::{BTreeMap, BTreeSet};

/// How the seed of a day stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DaySeed {
    /// It must not leave the server.
    Secret {
        /// Evaluations of the day that are queued, running or being scored.
        under_way: u32,
    },
    /// Nobody has it yet, and nothing of the day is under way: handing it out releases it.
    Releasable,
    /// Everybody may know it: a dataset was handed out, or the day is over and so are its evaluations,
    /// or the season is closed.
    Public,
}

/// When the first dataset of the day was handed out.
pub(crate) async fn released_at(
    connection: &mut SqliteConnection,
    day: Date,
) -> Result<Option<Timestamp>, StoreError> {
    let day = Text(day);
    let released = sqlx::query_scalar!(
        r#"SELECT released_at AS "at: Instant" FROM released_days WHERE day = ?"#,
        day
    )
    .fetch_optional(connection)
    .await?;
    Ok(released.map(|at| at.0))
}

async fn state(
    connection: &mut SqliteConnection,
    day: Date,
    now: Timestamp,
) -> Result<DaySeed, StoreError> {
    if released_at(connection, day).await?.is_some()
        || season::closed_at(connection).await?.is_some()
    {
        return Ok(DaySeed::Public);
    }
    let day_text = Text(day);
    let under_way = sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM evaluations
           WHERE day = ? AND state IN ('queued', 'running', 'finalising')"#,
        day_text
    )
    .fetch_one(connection)
    .await?;
    Ok(if under_way > 0 {
        DaySeed::Secret { under_way }
    } else if day < evaluations::utc_day(now) {
        DaySeed::Public
    } else {
        DaySeed::Releasable
    })
}

impl Store {
    /// How the seeds of these days stand, in one look.
    pub async fn day_seeds(
        &self,
        days: BTreeSet<Date>,
        now: Timestamp,
    ) -> Result<BTreeMap<Date, DaySeed>, StoreError> {
        let mut tx = self.database.read.begin().await?;
        let mut seeds = BTreeMap::new();
        for day in days {
            seeds.insert(day, state(&mut tx, day, now).await?);
        }
        Ok(seeds)
    }

    /// To be called before anything that carries the seed of `day` is handed out: notes `now` as the
    /// day's release unless it is [`DaySeed::Public`] already. Hand it out only if the answer is
    /// [`DaySeed::Public`]; else it is [`DaySeed::Secret`].
    pub async fn release_day(&self, day: Date, now: Timestamp) -> Result<DaySeed, StoreError> {
        // The writer's lock: no evaluation begins between the look and the note.
        let mut tx = self.database.begin().await?;
        match state(&mut tx, day, now).await? {
            DaySeed::Releasable => {
                let (day, now) = (Text(day), Instant(now));
                sqlx::query!(
                    "INSERT INTO released_days (day, released_at) VALUES (?, ?)",
                    day,
                    now
                )
                .execute(&mut *tx)
                .await?;
                tx.commit().await?;
                Ok(DaySeed::Public)
            }
            state => Ok(state),
        }
    }

    /// The days that have evaluations, the newest first, each with how many of them are finished.
    pub async fn days(&self) -> Result<Vec<(Date, u32)>, StoreError> {
        let days = sqlx::query!(
            r#"SELECT day AS "day: Text<Date>", SUM(state = 'finished') AS "finished!: u32"
               FROM evaluations GROUP BY day ORDER BY day DESC"#
        )
        .fetch_all(&self.database.read)
        .await?;
        Ok(days
            .into_iter()
            .map(|row| (row.day.0, row.finished))
            .collect())
    }
}
