//! Progress of runs: the number of episodes that are done.

use crate::{
    column::{Instant, Json},
    error::Result,
};
use faceoff_types::RunId;
use jiff::{Timestamp, TimestampRound, Unit};
use sqlx::SqliteConnection;
use std::collections::HashMap;

/// Progress of a run, or of several runs together.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RunProgress {
    /// Number of episodes done, as reported by the workers.
    pub episodes_done: u32,
    /// The committed shards.
    pub commits: Vec<ShardProgress>,
}

/// A committed shard in the progress of its run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShardProgress {
    pub committed_at: Timestamp,
    pub episodes: u32,
}

impl RunProgress {
    /// Number of episodes of the shards that were committed before the minute of `now` began. Teams see no more than this: an agent could
    /// otherwise signal to its team by the timing of its episodes.
    #[must_use]
    pub fn episodes_visible_to_team(&self, now: Timestamp) -> u32 {
        let minute = TimestampRound::new()
            .smallest(Unit::Minute)
            .mode(jiff::RoundMode::Floor);
        let start_of_minute = now.round(minute).unwrap_or(now);
        self.commits
            .iter()
            .filter(|shard| shard.committed_at < start_of_minute)
            .map(|shard| shard.episodes)
            .sum()
    }

    /// Adds the progress of another run.
    pub(crate) fn add(&mut self, other: Self) {
        self.episodes_done += other.episodes_done;
        self.commits.extend(other.commits);
    }
}

/// Progress of each of these runs, in one query.
pub(crate) async fn of_runs(
    connection: &mut SqliteConnection,
    runs: &[RunId],
) -> Result<HashMap<RunId, RunProgress>> {
    let mut progress: HashMap<RunId, RunProgress> = HashMap::new();
    if runs.is_empty() {
        return Ok(progress);
    }
    let rows = sqlx::query!(
        r#"SELECT s.run_id AS run, j.progress AS "episodes_done: u32", s.committed_at AS "committed_at: Instant",
                  s.end_episode - s.first_episode AS "episodes!: u32"
           FROM shards s JOIN jobs j ON j.id = s.job_id
           WHERE s.run_id IN (SELECT value FROM json_each(?))"#,
        Json(runs),
    )
    .fetch_all(connection)
    .await?;
    for row in rows {
        let run = progress.entry(row.run).or_default();
        run.episodes_done += row.episodes_done;
        run.commits.extend(row.committed_at.map(|at| ShardProgress {
            committed_at: at.0,
            episodes: row.episodes,
        }));
    }
    Ok(progress)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_shards_show_at_the_next_minute() {
        let at = |text: &str| -> Timestamp { text.parse().unwrap() };
        let shard = |committed_at, episodes| ShardProgress {
            committed_at: at(committed_at),
            episodes,
        };
        let progress = RunProgress {
            episodes_done: 120,
            commits: vec![
                shard("2026-03-01T12:00:59.9Z", 50),
                shard("2026-03-01T12:01:00Z", 40),
            ],
        };
        for (now, expected) in [
            ("2026-03-01T12:00:59.95Z", 0),
            ("2026-03-01T12:01:00Z", 50),
            ("2026-03-01T12:01:59.999Z", 50),
            ("2026-03-01T12:02:00Z", 90),
        ] {
            assert_eq!(
                progress.episodes_visible_to_team(at(now)),
                expected,
                "{now}"
            );
        }
    }
}
