//! Recent durations of jobs: their slot time, for which a slot of a worker was occupied (the column `charged_ms`). Of the
//! evaluations those of days are read (`counting_evaluations`), also if they were voided later; no trials and no proposed
//! re-evaluations.

use crate::{column::Instant, error::Result};
use faceoff_types::{EvaluationId, RunId, StageDay, TeamId};
use jiff::{SignedDuration, Timestamp, tz::TimeZone};
use sqlx::{SqliteConnection, types::Text};
use std::collections::HashMap;

/// Length of the measured period: a week has the current agents and all days of the week.
const PERIOD: SignedDuration = SignedDuration::from_hours(7 * 24);

/// Mean slot time of recent jobs, in milliseconds; `None` or absent if none was measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JobDurations {
    /// An episode, by team, including its share of starting and stopping the agent.
    pub episode_ms: HashMap<TeamId, f64>,
    /// An episode of any team.
    pub mean_episode_ms: Option<f64>,
    /// A validation run.
    pub validation_ms: Option<f64>,
    /// A scoring job.
    pub scoring_ms: Option<f64>,
    /// A control step of a game of any teams.
    pub game_step_ms: Option<f64>,
}

impl JobDurations {
    /// Mean slot time of an episode of this team; of any team if none of this team was measured.
    #[must_use]
    pub fn episode_ms_of(&self, team: TeamId) -> Option<f64> {
        self.episode_ms.get(&team).copied().or(self.mean_episode_ms)
    }
}

/// An evaluation that has not ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OpenEvaluation {
    pub(crate) id: EvaluationId,
    pub(crate) team: TeamId,
    pub(crate) stage_day: StageDay,
    pub(crate) run: RunId,
    /// Number of episodes in its committed shards.
    pub(crate) done_episodes: u32,
    /// Slot time of these episodes, in milliseconds.
    pub(crate) done_ms: i64,
    /// Number of episodes in its other shards.
    pub(crate) episodes_left: u32,
    /// Number of its other shards.
    pub(crate) shards_left: u32,
    /// It ends without a score after more agent faults than this.
    pub(crate) max_faults: u32,
}

/// All open evaluations, in the order in which they were queued.
pub(crate) async fn open_evaluations(
    connection: &mut SqliteConnection,
) -> Result<Vec<OpenEvaluation>> {
    let rows = sqlx::query!(
        r#"SELECT e.id AS "id!", e.team_id AS "team!", e.stage_id AS "stage!", e.day AS "day!", e.run_id AS "run!",
                  r.max_faults AS "max_faults!",
                  SUM(CASE WHEN j.state = 'done' AND j.charged_ms > 0
                           THEN s.end_episode - s.first_episode ELSE 0 END) AS "done_episodes!: u32",
                  SUM(CASE WHEN j.state = 'done' THEN j.charged_ms ELSE 0 END) AS "done_ms!: i64",
                  SUM(CASE WHEN j.state <> 'done' THEN s.end_episode - s.first_episode ELSE 0 END) AS "episodes_left!: u32",
                  SUM(j.state <> 'done') AS "shards_left!: u32"
           FROM counting_evaluations e JOIN runs r ON r.id = e.run_id JOIN shards s ON s.run_id = e.run_id
           JOIN jobs j ON j.id = s.job_id
           WHERE e.state = 'open' GROUP BY +e.id ORDER BY e.created_at, e.id"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| OpenEvaluation {
            id: row.id,
            team: row.team,
            stage_day: StageDay {
                stage: row.stage,
                date: row.day.0,
            },
            run: row.run,
            done_episodes: row.done_episodes,
            done_ms: row.done_ms,
            episodes_left: row.episodes_left,
            shards_left: row.shards_left,
            max_faults: row.max_faults,
        })
        .collect())
}

/// The durations of the week until `now`, including those of open evaluations.
pub(crate) async fn recent(
    connection: &mut SqliteConnection,
    open_evaluations: &[OpenEvaluation],
    now: Timestamp,
) -> Result<JobDurations> {
    let since = now.saturating_sub(PERIOD).unwrap_or(Timestamp::MIN);
    // A stage's date may differ by a day from the UTC date.
    let first_day = since.to_zoned(TimeZone::UTC).date();
    let (first_day, since) = (
        Text(first_day.yesterday().unwrap_or(first_day)),
        Instant(since),
    );
    let rows = sqlx::query!(
        r#"SELECT e.team_id AS "team!", SUM(e.slot_ms) AS "slot_ms!: i64",
                  SUM(r.episodes_per_task * json_array_length(r.tasks)) AS "episodes!: i64"
           FROM counting_evaluations e JOIN runs r ON r.id = e.run_id
           WHERE e.day >= ? AND e.finished_at >= ? AND e.state = 'finished' AND e.slot_ms > 0 GROUP BY +e.team_id"#,
        first_day,
        since
    )
    .fetch_all(&mut *connection)
    .await?;
    let running = open_evaluations.iter().map(|evaluation| {
        (
            evaluation.team,
            evaluation.done_ms,
            i64::from(evaluation.done_episodes),
        )
    });
    let finished = rows
        .into_iter()
        .map(|row| (row.team, row.slot_ms, row.episodes));
    // Slot time in milliseconds and number of episodes.
    let mut by_team: HashMap<TeamId, (i64, i64)> = HashMap::new();
    for (team, ms, episodes) in finished.chain(running).filter(|(_, _, count)| *count > 0) {
        let sum = by_team.entry(team).or_default();
        *sum = (sum.0 + ms, sum.1 + episodes);
    }
    let total = by_team
        .values()
        .fold((0, 0), |total, team| (total.0 + team.0, total.1 + team.1));
    let validation_ms = sqlx::query_scalar!(
        r#"SELECT AVG(j.charged_ms) AS "ms: f64"
           FROM submissions s JOIN validation_runs r ON r.submission_id = s.id JOIN jobs j ON j.id = r.job_id
           WHERE s.created_at >= ? AND j.state = 'done' AND j.charged_ms > 0"#,
        since
    )
    .fetch_one(&mut *connection)
    .await?;
    let scoring_ms = sqlx::query_scalar!(
        r#"SELECT AVG(j.charged_ms) AS "ms: f64"
           FROM counting_evaluations e JOIN scorings s ON s.evaluation_id = e.id JOIN jobs j ON j.id = s.job_id
           WHERE e.day >= ? AND e.finished_at >= ? AND j.state = 'done' AND j.charged_ms > 0"#,
        first_day,
        since
    )
    .fetch_one(&mut *connection)
    .await?;
    let game_step_ms = sqlx::query_scalar!(
        r#"SELECT AVG(CAST(j.charged_ms AS REAL) / json_extract(t.rules, '$.steps')) AS "ms: f64"
           FROM games g JOIN tournaments t ON t.id = g.tournament_id JOIN jobs j ON j.id = g.job_id
           WHERE g.ended_at >= ? AND g.state = 'played' AND j.state = 'done' AND j.charged_ms > 0"#,
        since
    )
    .fetch_one(connection)
    .await?;
    Ok(JobDurations {
        game_step_ms,
        mean_episode_ms: mean_ms(total),
        episode_ms: by_team
            .into_iter()
            .filter_map(|(team, sum)| Some((team, mean_ms(sum)?)))
            .collect(),
        validation_ms,
        scoring_ms,
    })
}

/// Mean slot time of an episode; `None` if there are no episodes.
fn mean_ms((ms, episodes): (i64, i64)) -> Option<f64> {
    (episodes > 0).then(|| ms as f64 / episodes as f64)
}
