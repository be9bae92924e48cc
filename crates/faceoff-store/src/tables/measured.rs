//! How long work took of late, as the queue charged it.

use crate::{column::Instant, error::Result};
use faceoff_types::{EvaluationId, RunId, StageDay, StageId, TeamId};
use jiff::{SignedDuration, Timestamp, civil::Date, tz::TimeZone};
use sqlx::{SqliteConnection, types::Text};
use std::collections::HashMap;

/// How far back is looked: a week, which has the agents of now and all days of the week.
const LATELY: SignedDuration = SignedDuration::from_hours(7 * 24);

/// Slot time that work took of late, milliseconds; `None` and absent: none of it was measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// Of an episode, by team, with what starting and ending its agent takes.
    pub episode_ms: HashMap<TeamId, f64>,
    /// Of an episode, whoever played.
    pub any_episode_ms: Option<f64>,
    /// Of a smoke run.
    pub smoke_ms: Option<f64>,
    /// Of computing a score.
    pub finalisation_ms: Option<f64>,
    /// Of a control step of a game, whoever played.
    pub game_step_ms: Option<f64>,
}

impl Measured {
    /// Of an episode of this team; of any, if none of its own was measured.
    #[must_use]
    pub fn episode_ms_of(&self, team: TeamId) -> Option<f64> {
        self.episode_ms.get(&team).copied().or(self.any_episode_ms)
    }
}

/// An evaluation that is not over.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Open {
    pub(crate) id: EvaluationId,
    pub(crate) team: TeamId,
    pub(crate) of: StageDay,
    pub(crate) run: RunId,
    /// Of its shards that are committed: episodes, and the slot time that they took, milliseconds.
    pub(crate) done: (u32, i64),
    /// Of its shards that are not.
    pub(crate) episodes_left: u32,
    /// Of its shards that are not.
    pub(crate) shards_left: u32,
    /// More agent faults than this end it.
    pub(crate) max_faults: u32,
}

/// All evaluations that are not over, in the order in which they were queued.
pub(crate) async fn open(connection: &mut SqliteConnection) -> Result<Vec<Open>> {
    let rows = sqlx::query!(
        r#"SELECT e.id AS "id!: Text<EvaluationId>", e.team_id AS "team!: Text<TeamId>",
                  e.stage_id AS "stage!: Text<StageId>", e.day AS "day!: Text<Date>", e.run_id AS "run!: Text<RunId>",
                  r.max_faults AS "max_faults!: u32",
                  SUM(CASE WHEN u.state = 'done' AND u.charged_ms > 0 THEN s.end_episode - s.first_episode ELSE 0 END)
                      AS "done_episodes!: u32",
                  SUM(CASE WHEN u.state = 'done' THEN u.charged_ms ELSE 0 END) AS "done_ms!: i64",
                  SUM(CASE WHEN u.state <> 'done' THEN s.end_episode - s.first_episode ELSE 0 END)
                      AS "episodes_left!: u32",
                  SUM(u.state <> 'done') AS "shards_left!: u32"
           FROM evaluations e JOIN runs r ON r.id = e.run_id JOIN shards s ON s.run_id = e.run_id
           JOIN units u ON u.id = s.unit_id
           WHERE e.state = 'open' GROUP BY +e.id ORDER BY e.created_at, e.id"#
    )
    .fetch_all(connection)
    .await?;
    Ok(rows
        .into_iter()
        .map(|row| Open {
            id: row.id.0,
            team: row.team.0,
            of: StageDay {
                stage: row.stage.0,
                date: row.day.0,
            },
            run: row.run.0,
            done: (row.done_episodes, row.done_ms),
            episodes_left: row.episodes_left,
            shards_left: row.shards_left,
            max_faults: row.max_faults,
        })
        .collect())
}

/// What was measured in the week until `now`, and in what is under way.
pub(crate) async fn lately(
    connection: &mut SqliteConnection,
    open: &[Open],
    now: Timestamp,
) -> Result<Measured> {
    let since = now.saturating_sub(LATELY).unwrap_or(Timestamp::MIN);
    // A day's date may be a day off from UTC's.
    let first = since.to_zoned(TimeZone::UTC).date();
    let (first, since) = (Text(first.yesterday().unwrap_or(first)), Instant(since));
    let rows = sqlx::query!(
        r#"SELECT e.team_id AS "team!: Text<TeamId>", SUM(e.slot_ms) AS "slot_ms!: i64",
                  SUM(r.episodes_per_task * json_array_length(r.tasks)) AS "episodes!: i64"
           FROM evaluations e JOIN runs r ON r.id = e.run_id
           WHERE e.day >= ? AND e.finished_at >= ? AND e.state = 'finished' AND e.slot_ms > 0 GROUP BY +e.team_id"#,
        first,
        since
    )
    .fetch_all(&mut *connection)
    .await?;
    let of_open = open
        .iter()
        .map(|open| (open.team, open.done.1, i64::from(open.done.0)));
    let finished = rows
        .into_iter()
        .map(|row| (row.team.0, row.slot_ms, row.episodes));
    let mut of_team: HashMap<TeamId, (i64, i64)> = HashMap::new();
    for (team, ms, episodes) in finished.chain(of_open).filter(|(_, _, count)| *count > 0) {
        let sum = of_team.entry(team).or_default();
        *sum = (sum.0 + ms, sum.1 + episodes);
    }
    let all = of_team.values().fold((0, 0), |all, of_team| {
        (all.0 + of_team.0, all.1 + of_team.1)
    });
    let smoke_ms = sqlx::query_scalar!(
        r#"SELECT AVG(u.charged_ms) AS "ms: f64"
           FROM submissions s JOIN smoke_runs r ON r.submission_id = s.id JOIN units u ON u.id = r.unit_id
           WHERE s.created_at >= ? AND u.state = 'done' AND u.charged_ms > 0"#,
        since
    )
    .fetch_one(&mut *connection)
    .await?;
    let finalisation_ms = sqlx::query_scalar!(
        r#"SELECT AVG(u.charged_ms) AS "ms: f64"
           FROM evaluations e JOIN finalisations f ON f.evaluation_id = e.id JOIN units u ON u.id = f.unit_id
           WHERE e.day >= ? AND e.finished_at >= ? AND u.state = 'done' AND u.charged_ms > 0"#,
        first,
        since
    )
    .fetch_one(&mut *connection)
    .await?;
    let game_step_ms = sqlx::query_scalar!(
        r#"SELECT AVG(CAST(u.charged_ms AS REAL) / json_extract(t.rules, '$.steps')) AS "ms: f64"
           FROM games g JOIN tournaments t ON t.id = g.tournament_id JOIN units u ON u.id = g.unit_id
           WHERE g.ended_at >= ? AND g.state = 'played' AND u.state = 'done' AND u.charged_ms > 0"#,
        since
    )
    .fetch_one(connection)
    .await?;
    Ok(Measured {
        game_step_ms,
        any_episode_ms: mean(all),
        episode_ms: of_team
            .into_iter()
            .filter_map(|(team, sum)| Some((team, mean(sum)?)))
            .collect(),
        smoke_ms,
        finalisation_ms,
    })
}

fn mean((ms, episodes): (i64, i64)) -> Option<f64> {
    (episodes > 0).then(|| ms as f64 / episodes as f64)
}
