//! When a day's seed may leave the server.
//!
//! All evaluations of a day play the same episodes, and their datasets carry the seed that makes them.
//! So datasets are held back until no evaluation of the day is under way, and once one has been
//! handed out, nothing that was uploaded later plays that day.

use crate::{
    error::Result,
    event::{Actor, Event, Subject},
    store::Store,
    tables::{evaluations, released_days, season},
};
use jiff::{Timestamp, civil::Date, tz::TimeZone};
use sqlx::SqliteConnection;
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

/// The UTC day of an instant.
pub(crate) fn utc_day(now: Timestamp) -> Date {
    now.to_zoned(TimeZone::UTC).date()
}

async fn state(connection: &mut SqliteConnection, day: Date, now: Timestamp) -> Result<DaySeed> {
    if released_days::released_at(connection, day).await?.is_some()
        || season::read(connection).await?.closed_at.is_some()
    {
        return Ok(DaySeed::Public);
    }
    let under_way = evaluations::count_open(connection, Some(day)).await?;
    Ok(if under_way > 0 {
        DaySeed::Secret { under_way }
    } else if day < utc_day(now) {
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
    ) -> Result<BTreeMap<Date, DaySeed>> {
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
    pub async fn release_day(&self, actor: Actor, day: Date, now: Timestamp) -> Result<DaySeed> {
        // The writer's lock: no evaluation begins between the look and the note.
        self.write(actor, now, async |tx| match state(tx, day, now).await? {
            DaySeed::Releasable => {
                released_days::insert(tx, day, now).await?;
                tx.record(Subject::Day(day), Event::DayReleased);
                Ok(DaySeed::Public)
            }
            state => Ok(state),
        })
        .await
    }
}
