//! Forecast of the queue: positions and expected ends of waiting submissions, evaluations and games. The order in which
//! the queue serves jobs is simulated, with the recent durations of similar jobs. There is no expected end if no similar
//! job was measured.

use crate::{
    boxed_future,
    column::Instant,
    error::Result,
    queue::forecast::{AccountQueue, DurationMs, Forecast, GroupEnd, JobGroup, QueuedJob},
    store::Store,
    tables::{
        job_durations::{self, JobDurations, OpenEvaluation},
        season,
    },
};
use faceoff_types::{EvaluationId, GameId, RunId, StageDay, SubmissionId, TeamId};
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;
use std::collections::{BTreeMap, HashMap};

/// Position of a submission, evaluation or game in the queue, among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueuePosition {
    /// From 1: rank by expected end.
    pub position: u32,
    /// Number of those that are open.
    pub total: u32,
    /// Expected end; `None` while the queue is paused, and if it depends on an unknown duration.
    pub expected_at: Option<Timestamp>,
}

/// Queue positions of all open submissions, evaluations and games.
#[derive(Debug, Clone, Default)]
pub struct QueueForecast {
    /// A submission ends with its validation run.
    pub submissions: HashMap<SubmissionId, QueuePosition>,
    /// An evaluation ends with its score.
    pub evaluations: HashMap<EvaluationId, QueuePosition>,
    /// A game ends with its result; games of paused tournaments are left out.
    pub games: HashMap<GameId, QueuePosition>,
}

impl QueueForecast {
    /// When the last of them is expected to end: `now` if nothing is open, `None` if it depends on an unknown duration.
    #[must_use]
    pub fn completed_at(&self, now: Timestamp) -> Option<Timestamp> {
        let positions = self
            .submissions
            .values()
            .chain(self.evaluations.values())
            .chain(self.games.values());
        positions
            .map(|position| position.expected_at)
            .try_fold(now, |latest, at| at.map(|at| latest.max(at)))
    }
}

/// Episodes that an open evaluation still has to run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvaluationBacklog {
    pub stage_day: StageDay,
    pub team: TeamId,
    /// Episodes that are not committed.
    pub episodes: u32,
    /// Number of shards with these episodes.
    pub shards: u32,
    /// The evaluation ends without a score after more agent faults than this.
    pub max_faults: u32,
    /// Slot time that these episodes will take, in milliseconds, by recent durations; `None` if none was measured.
    pub expected_ms: Option<f64>,
}

/// An open job with its purpose.
struct OpenJob {
    /// Number of its account.
    account: i64,
    /// Jobs of a smaller batch come first within a lane; within a batch and account, those with a smaller `queue_no`. The batch is the
    /// time of the cutoff or request in milliseconds, the matchday of a round's game, the number of a repetition of the tournament's
    /// schedule, or 0.
    batch: i64,
    /// Rises with every queued job.
    queue_no: i64,
    is_leased: bool,
    /// For a leased job: when its lease expires.
    claimable_at: Instant,
    /// Slot time charged for this job so far, including the rest of its lease.
    charged_ms: i64,
    /// Urgency of its lane: smaller ones are served first.
    urgency: u32,
    /// Number of episodes of a shard.
    episodes: Option<u32>,
    /// Owner of the account: a team, a tournament, or empty for the platform. Not a lease holder.
    holder: String,
    run: Option<RunId>,
    validation_of: Option<SubmissionId>,
    scoring_of: Option<EvaluationId>,
    game: Option<GameId>,
    /// Length of a game by the tournament's rules, in control steps.
    game_steps: Option<u32>,
    /// Is the game's tournament paused?
    is_paused: bool,
}

async fn open_jobs(connection: &mut SqliteConnection) -> Result<Vec<OpenJob>> {
    Ok(sqlx::query_as!(
        OpenJob,
        r#"SELECT j.account_no AS "account!: i64", j.batch, j.queue_no, j.state = 'leased' AS "is_leased!: bool",
                  j.claimable_at, j.charged_ms, l.urgency,
                  s.end_episode - s.first_episode AS "episodes?: u32", a.holder, s.run_id AS "run?",
                  v.submission_id AS "validation_of?", c.evaluation_id AS "scoring_of?", g.id AS "game?",
                  json_extract(t.rules, '$.steps') AS "game_steps?: u32", t.paused_at IS NOT NULL AS "is_paused!: bool"
           FROM jobs j JOIN accounts a ON a.account_no = j.account_no JOIN lanes l ON l.lane = a.lane
           LEFT JOIN shards s ON s.job_id = j.id LEFT JOIN validation_runs v ON v.job_id = j.id
           LEFT JOIN scorings c ON c.job_id = j.id
           LEFT JOIN games g ON g.job_id = j.id LEFT JOIN tournaments t ON t.id = g.tournament_id
           WHERE j.state IN ('queued', 'leased') ORDER BY j.batch, j.queue_no"#
    )
    .fetch_all(connection)
    .await?)
}

/// All accounts by number, without their jobs. Lanes with a smaller urgency are always served first; of two equally served lanes of one
/// urgency, the one with the smaller tie-breaker.
async fn accounts(connection: &mut SqliteConnection) -> Result<BTreeMap<i64, AccountQueue>> {
    let rows = sqlx::query!(
        "SELECT a.account_no, a.lane, l.urgency, l.rank, l.served_ms AS of_lane, a.served_ms
         FROM accounts a JOIN lanes l ON l.lane = a.lane"
    )
    .fetch_all(connection)
    .await?;
    let mut lanes = Vec::new();
    Ok(rows
        .into_iter()
        .map(|row| {
            let index = lanes.iter().position(|lane| *lane == row.lane);
            let lane = index.unwrap_or_else(|| {
                lanes.push(row.lane);
                lanes.len() - 1
            });
            let account = AccountQueue {
                lane,
                urgency: row.urgency,
                tie_breaker: row.rank,
                lane_served_ms: row.of_lane as f64,
                served_ms: row.served_ms as f64,
                waiting: Default::default(),
            };
            (row.account_no, account)
        })
        .collect())
}

/// The submission, evaluation or game that a group of jobs belongs to.
#[derive(Clone, Copy, PartialEq)]
enum GroupTarget {
    Submission(SubmissionId),
    Evaluation(EvaluationId),
    Game(GameId),
    /// Jobs that get no position, such as those of an ablation or of a proposed re-evaluation: they only occupy slots.
    WithoutPosition,
}

/// Greatest urgency value of the lanes that the forecast covers: validation runs, scoring, shards and games that count.
const MAX_URGENCY: u32 = 1;

/// Urgency of the lane of scoring jobs.
const SCORING_URGENCY: u32 = 0;

/// Mean duration of an episode of an open evaluation, in milliseconds: in its committed shards, or else in its team's
/// recent episodes.
fn episode_ms(evaluation: &OpenEvaluation, durations: &JobDurations) -> Option<f64> {
    match evaluation.done_episodes {
        0 => durations.episode_ms_of(evaluation.team),
        episodes => Some(evaluation.done_ms as f64 / f64::from(episodes)),
    }
}

/// The groups of jobs that end together, for the forecast.
struct JobGroups<'a> {
    durations: &'a JobDurations,
    /// The first groups are those of these evaluations.
    evaluations: &'a [OpenEvaluation],
    /// Index of the evaluation's group, by run.
    index_by_run: HashMap<RunId, usize>,
    groups: Vec<(GroupTarget, JobGroup)>,
}

impl<'a> JobGroups<'a> {
    fn of_evaluations(evaluations: &'a [OpenEvaluation], durations: &'a JobDurations) -> Self {
        let follow_up = Some(durations.scoring_ms);
        let group = |evaluation: &OpenEvaluation| {
            (
                GroupTarget::Evaluation(evaluation.id),
                JobGroup { follow_up },
            )
        };
        Self {
            durations,
            evaluations,
            index_by_run: (0..)
                .zip(evaluations)
                .map(|(index, evaluation)| (evaluation.run, index))
                .collect(),
            groups: evaluations.iter().map(group).collect(),
        }
    }

    /// Adds a job. Returns the index of its group, and the whole duration of the job.
    fn add_job(&mut self, job: &OpenJob) -> (usize, DurationMs) {
        let group_of_run = |run: &RunId| self.index_by_run.get(run).copied();
        if let Some(group) = job.run.as_ref().and_then(group_of_run) {
            let mean_ms = episode_ms(&self.evaluations[group], self.durations);
            let duration = job.episodes.zip(mean_ms);
            return (
                group,
                duration.map(|(episodes, ms)| f64::from(episodes) * ms),
            );
        }
        if let Some(id) = &job.scoring_of {
            let is_target =
                |(target, _): &(GroupTarget, JobGroup)| *target == GroupTarget::Evaluation(*id);
            if let Some(group) = self.groups.iter().position(is_target) {
                // The scoring job is queued already.
                self.groups[group].1.follow_up = None;
                return (group, self.durations.scoring_ms);
            }
        }
        if let Some(id) = &job.game {
            let duration = job.game_steps.zip(self.durations.game_step_ms);
            let duration = duration.map(|(steps, ms)| f64::from(steps) * ms);
            return (self.push(GroupTarget::Game(*id)), duration);
        }
        let (target, duration) = match &job.validation_of {
            Some(id) => (GroupTarget::Submission(*id), self.durations.validation_ms),
            None if job.urgency == SCORING_URGENCY => {
                (GroupTarget::WithoutPosition, self.durations.scoring_ms)
            }
            None => {
                let team: Option<TeamId> = job.holder.parse().ok();
                let mean_ms = team.and_then(|team| self.durations.episode_ms_of(team));
                let duration = job.episodes.zip(mean_ms);
                let duration = duration.map(|(episodes, ms)| f64::from(episodes) * ms);
                (GroupTarget::WithoutPosition, duration)
            }
        };
        (self.push(target), duration)
    }

    fn push(&mut self, target: GroupTarget) -> usize {
        self.groups.push((target, JobGroup { follow_up: None }));
        self.groups.len() - 1
    }
}

impl OpenJob {
    /// The remaining duration of a running job, by the time since its claim. Not by the episodes that it has reported: teams see the
    /// forecast, and an agent could signal to its team by the timing of its episodes.
    fn remaining_ms(&self, duration: DurationMs, now: Timestamp) -> DurationMs {
        let duration_ms = duration?;
        let lease_rest_ms = self.claimable_at.0.as_millisecond() - now.as_millisecond();
        let elapsed_ms = (self.charged_ms - lease_rest_ms).max(0) as f64;
        Some((duration_ms - elapsed_ms).max(0.0))
    }
}

impl Store {
    /// Queue positions and expected ends, provided that this number of slots runs jobs and no job is added.
    #[boxed_future]
    pub async fn queue_forecast(&self, slots: u32, now: Timestamp) -> Result<QueueForecast> {
        let mut tx = self.database.read.begin().await?;
        let open_jobs = open_jobs(&mut tx).await?;
        if open_jobs.is_empty() {
            return Ok(QueueForecast::default());
        }
        let evaluations = job_durations::open_evaluations(&mut tx).await?;
        let durations = job_durations::recent(&mut tx, &evaluations, now).await?;
        let is_paused = season::is_paused(&mut tx).await?;
        let mut accounts = accounts(&mut tx).await?;
        drop(tx);

        let mut groups = JobGroups::of_evaluations(&evaluations, &durations);
        let mut running = Vec::new();
        for job in &open_jobs {
            let is_running = job.is_leased && job.claimable_at.0 > now;
            if (job.urgency > MAX_URGENCY || job.is_paused) && !is_running {
                continue;
            }
            let (group, duration) = groups.add_job(job);
            if is_running {
                running.push((job.remaining_ms(duration, now), group));
            } else if let Some(account) = accounts.get_mut(&job.account) {
                let delay_ms = job.claimable_at.0.as_millisecond() - now.as_millisecond();
                account.waiting.push_back(QueuedJob {
                    batch: job.batch,
                    queue_no: job.queue_no,
                    claimable_in_ms: delay_ms.max(0) as f64,
                    duration,
                    group,
                });
            }
        }
        let (targets, groups): (Vec<GroupTarget>, Vec<JobGroup>) =
            groups.groups.into_iter().unzip();
        let forecast = Forecast {
            accounts: accounts.into_values().collect(),
            groups,
            running,
        };
        let ends = forecast.ends(usize::try_from(slots).unwrap_or(1));
        Ok(positions(&targets, &ends, is_paused, now))
    }

    /// The backlog of all open evaluations, and the recent durations of jobs.
    #[boxed_future]
    pub async fn evaluation_backlog(
        &self,
        now: Timestamp,
    ) -> Result<(Vec<EvaluationBacklog>, JobDurations)> {
        let mut tx = self.database.read.begin().await?;
        let open = job_durations::open_evaluations(&mut tx).await?;
        let durations = job_durations::recent(&mut tx, &open, now).await?;
        let backlog = |open: &OpenEvaluation| EvaluationBacklog {
            stage_day: open.stage_day,
            team: open.team,
            episodes: open.episodes_left,
            shards: open.shards_left,
            max_faults: open.max_faults,
            expected_ms: episode_ms(open, &durations).map(|ms| ms * f64::from(open.episodes_left)),
        };
        Ok((open.iter().map(backlog).collect(), durations))
    }
}

/// The positions of all groups, counted separately for submissions, evaluations and games.
fn positions(
    targets: &[GroupTarget],
    ends: &[GroupEnd],
    is_paused: bool,
    now: Timestamp,
) -> QueueForecast {
    let mut by_end: Vec<(&GroupTarget, &GroupEnd)> = targets.iter().zip(ends).collect();
    by_end.sort_by_key(|(_, end)| end.rank);
    let count = |is_kind: fn(&GroupTarget) -> bool| {
        let count = targets.iter().filter(|target| is_kind(target)).count();
        u32::try_from(count).unwrap_or(u32::MAX)
    };
    let submissions = count(|target| matches!(target, GroupTarget::Submission(_)));
    let evaluations = count(|target| matches!(target, GroupTarget::Evaluation(_)));
    let games = count(|target| matches!(target, GroupTarget::Game(_)));
    let mut forecast = QueueForecast::default();
    let expected_at = |end: &GroupEnd| {
        let remaining_ms = end.remaining_ms.filter(|_| !is_paused)?;
        let duration = SignedDuration::try_from_secs_f64(remaining_ms / 1000.0).ok()?;
        now.checked_add(duration).ok()
    };
    let (mut last_submission, mut last_evaluation, mut last_game) = (0, 0, 0);
    for (target, end) in by_end {
        let expected_at = expected_at(end);
        let next_position = |last: &mut u32, total| {
            *last += 1;
            QueuePosition {
                position: *last,
                total,
                expected_at,
            }
        };
        match target {
            GroupTarget::Submission(id) => {
                let position = next_position(&mut last_submission, submissions);
                forecast.submissions.insert(*id, position);
            }
            GroupTarget::Evaluation(id) => {
                let position = next_position(&mut last_evaluation, evaluations);
                forecast.evaluations.insert(*id, position);
            }
            GroupTarget::Game(id) => {
                let position = next_position(&mut last_game, games);
                forecast.games.insert(*id, position);
            }
            GroupTarget::WithoutPosition => {}
        }
    }
    forecast
}
