//! Where what waits stands in the queue, and when it will be over: the queue's own rule, played through with the
//! times that such work took of late. Nothing is invented: what was never measured has no time.

use crate::{
    boxed,
    column::Instant,
    error::Result,
    queue::forecast::{Duration, End, Forecast, Holder, Job, Waiting},
    store::Store,
    tables::{
        measured::{self, Measured, Open},
        season,
    },
};
use faceoff_types::{EvaluationId, GameId, RunId, StageDay, SubmissionId, TeamId};
use jiff::{SignedDuration, Timestamp};
use sqlx::{SqliteConnection, types::Text};
use std::collections::{BTreeMap, HashMap};

/// Where one thing stands among those of its sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueuePlace {
    /// From 1: of those that are not over, the how manieth it will be over.
    pub place: u32,
    /// How many are not over.
    pub of: u32,
    /// When; `None` while the queue is held, and where it depends on what was never measured.
    pub expected_at: Option<Timestamp>,
}

/// Everything that waits or is under way, and of which somebody waits for the end.
#[derive(Debug, Clone, Default)]
pub struct Outlook {
    /// Until their smoke runs are over.
    pub submissions: HashMap<SubmissionId, QueuePlace>,
    /// Until they are scored.
    pub evaluations: HashMap<EvaluationId, QueuePlace>,
    /// Until they have a result; those of a paused tournament are in none of it.
    pub games: HashMap<GameId, QueuePlace>,
}

impl Outlook {
    /// When all of it will be over: now if there is nothing, and `None` where that depends on what was never measured.
    #[must_use]
    pub fn over_at(&self, now: Timestamp) -> Option<Timestamp> {
        let places = self
            .submissions
            .values()
            .chain(self.evaluations.values())
            .chain(self.games.values());
        places
            .map(|place| place.expected_at)
            .try_fold(now, |latest, at| at.map(|at| latest.max(at)))
    }
}

/// What a day has left to play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenWork {
    pub of: StageDay,
    pub team: TeamId,
    /// Episodes that are not committed.
    pub episodes: u32,
    /// In so many units.
    pub shards: u32,
    /// More agent faults than this end it.
    pub max_faults: u32,
    /// Slot time that they will take, milliseconds, by what such episodes took of late; `None`: never measured.
    pub expected_ms: Option<f64>,
}

/// An open unit with what it is for.
struct OpenUnit {
    account: i64,
    batch: i64,
    queue_no: i64,
    is_leased: bool,
    claimable_at: Instant,
    charged_ms: i64,
    progress: u32,
    urgency: u32,
    episodes: Option<u32>,
    holder: String,
    run: Option<Text<RunId>>,
    smoke_of: Option<Text<SubmissionId>>,
    score_of: Option<Text<EvaluationId>>,
    game: Option<Text<GameId>>,
    game_steps: Option<u32>,
    is_paused: bool,
}

async fn open_units(connection: &mut SqliteConnection) -> Result<Vec<OpenUnit>> {
    Ok(sqlx::query_as!(
        OpenUnit,
        r#"SELECT u.account_no AS "account!: i64", u.batch, u.queue_no, u.state = 'leased' AS "is_leased!: bool",
                  u.claimable_at AS "claimable_at: Instant", u.charged_ms, u.progress AS "progress: u32",
                  l.urgency AS "urgency: u32", s.end_episode - s.first_episode AS "episodes?: u32",
                  a.holder, s.run_id AS "run?: Text<RunId>",
                  m.submission_id AS "smoke_of?: Text<SubmissionId>",
                  f.evaluation_id AS "score_of?: Text<EvaluationId>", g.id AS "game?: Text<GameId>",
                  json_extract(t.rules, '$.steps') AS "game_steps?: u32", t.paused_at IS NOT NULL AS "is_paused!: bool"
           FROM units u JOIN accounts a ON a.account_no = u.account_no JOIN lanes l ON l.lane = a.lane
           LEFT JOIN shards s ON s.unit_id = u.id LEFT JOIN smoke_runs m ON m.unit_id = u.id
           LEFT JOIN finalisations f ON f.unit_id = u.id
           LEFT JOIN games g ON g.unit_id = u.id LEFT JOIN tournaments t ON t.id = g.tournament_id
           WHERE u.state IN ('queued', 'leased') ORDER BY u.batch, u.queue_no"#
    )
    .fetch_all(connection)
    .await?)
}

async fn holders(connection: &mut SqliteConnection) -> Result<BTreeMap<i64, Holder>> {
    let rows = sqlx::query!(
        r#"SELECT a.account_no, a.lane, l.urgency AS "urgency: u32", l.rank AS "rank: u32",
                  l.served_ms AS of_lane, a.served_ms
           FROM accounts a JOIN lanes l ON l.lane = a.lane"#
    )
    .fetch_all(connection)
    .await?;
    let mut lanes = Vec::new();
    Ok(rows
        .into_iter()
        .map(|row| {
            let known = lanes.iter().position(|lane| *lane == row.lane);
            let lane = known.unwrap_or_else(|| {
                lanes.push(row.lane);
                lanes.len() - 1
            });
            let holder = Holder {
                lane,
                urgency: row.urgency,
                rank: row.rank,
                lane_served_ms: row.of_lane as f64,
                served_ms: row.served_ms as f64,
                waiting: Default::default(),
            };
            (row.account_no, holder)
        })
        .collect())
}

/// What an end is waited for.
#[derive(Clone, Copy, PartialEq)]
enum JobOf {
    Submission(SubmissionId),
    Evaluation(EvaluationId),
    Game(GameId),
    /// Ablations, trials and proposals: they only matter for the slots that they hold.
    Nobody,
}

/// The lanes whose work counts, or that somebody waits for, are of this urgency or a smaller one.
const COUNTS: u32 = 1;

/// The lane of what only waits for its score, whether it counts or not.
const FINALISES: u32 = 0;

fn episode_ms(open: &Open, measured: &Measured) -> Option<f64> {
    let (episodes, ms) = open.done;
    match episodes {
        0 => measured.episode_ms_of(open.team),
        _ => Some(ms as f64 / f64::from(episodes)),
    }
}

struct Jobs<'a> {
    measured: &'a Measured,
    open: &'a [Open],
    of_run: HashMap<RunId, usize>,
    jobs: Vec<(JobOf, Job)>,
}

impl<'a> Jobs<'a> {
    fn of(open: &'a [Open], measured: &'a Measured) -> Self {
        let then = Some(measured.finalisation_ms);
        let job = |open: &Open| (JobOf::Evaluation(open.id), Job { then });
        Self {
            measured,
            open,
            of_run: (0..).zip(open).map(|(at, open)| (open.run, at)).collect(),
            jobs: open.iter().map(job).collect(),
        }
    }

    /// Which job a unit is a part of, and how long all of it takes.
    fn of_unit(&mut self, unit: &OpenUnit) -> (usize, Duration) {
        let of_run = |run: &Text<RunId>| self.of_run.get(&run.0).copied();
        if let Some(job) = unit.run.as_ref().and_then(of_run) {
            let each_ms = episode_ms(&self.open[job], self.measured);
            let takes = unit.episodes.zip(each_ms);
            return (job, takes.map(|(episodes, ms)| f64::from(episodes) * ms));
        }
        if let Some(id) = &unit.score_of {
            let is_it = |(of, _): &(JobOf, Job)| *of == JobOf::Evaluation(id.0);
            if let Some(job) = self.jobs.iter().position(is_it) {
                // It is queued already.
                self.jobs[job].1.then = None;
                return (job, self.measured.finalisation_ms);
            }
        }
        if let Some(id) = &unit.game {
            let takes = unit.game_steps.zip(self.measured.game_step_ms);
            self.jobs.push((JobOf::Game(id.0), Job { then: None }));
            let takes = takes.map(|(steps, ms)| f64::from(steps) * ms);
            return (self.jobs.len() - 1, takes);
        }
        let (of, takes) = match &unit.smoke_of {
            Some(id) => (JobOf::Submission(id.0), self.measured.smoke_ms),
            None if unit.urgency == FINALISES => (JobOf::Nobody, self.measured.finalisation_ms),
            None => {
                let team: Option<TeamId> = unit.holder.parse().ok();
                let each_ms = team.and_then(|team| self.measured.episode_ms_of(team));
                let takes = unit.episodes.zip(each_ms);
                let takes = takes.map(|(episodes, ms)| f64::from(episodes) * ms);
                (JobOf::Nobody, takes)
            }
        };
        self.jobs.push((of, Job { then: None }));
        (self.jobs.len() - 1, takes)
    }
}

impl OpenUnit {
    /// What is left of one that is under way, by the episodes that it has told of, else by the time that it has had.
    fn left_ms(&self, takes: Duration, now: Timestamp) -> Duration {
        let takes_ms = takes?;
        let share_done = match self.episodes {
            Some(episodes) if episodes > 0 && self.progress > 0 => {
                f64::from(self.progress) / f64::from(episodes)
            }
            _ => {
                let rest_ms = self.claimable_at.0.as_millisecond() - now.as_millisecond();
                (self.charged_ms - rest_ms).max(0) as f64 / takes_ms.max(1.0)
            }
        };
        Some((takes_ms * (1.0 - share_done)).max(0.0))
    }
}

impl Store {
    /// Where everything that waits stands, if so many slots work, and when it will be over if nothing is added.
    #[boxed]
    pub async fn outlook(&self, slots: u32, now: Timestamp) -> Result<Outlook> {
        let mut tx = self.database.read.begin().await?;
        let units = open_units(&mut tx).await?;
        if units.is_empty() {
            return Ok(Outlook::default());
        }
        let open = measured::open(&mut tx).await?;
        let measured = measured::lately(&mut tx, &open, now).await?;
        let is_held = season::is_paused(&mut tx).await?;
        let mut accounts = holders(&mut tx).await?;
        drop(tx);

        let mut jobs = Jobs::of(&open, &measured);
        let mut running = Vec::new();
        for unit in &units {
            let is_running = unit.is_leased && unit.claimable_at.0 > now;
            if (unit.urgency > COUNTS || unit.is_paused) && !is_running {
                continue;
            }
            let (job, takes) = jobs.of_unit(unit);
            if is_running {
                running.push((unit.left_ms(takes, now), job));
            } else if let Some(holder) = accounts.get_mut(&unit.account) {
                let rest_ms = unit.claimable_at.0.as_millisecond() - now.as_millisecond();
                holder.waiting.push_back(Waiting {
                    batch: unit.batch,
                    queue_no: unit.queue_no,
                    from_ms: rest_ms.max(0) as f64,
                    takes,
                    job,
                });
            }
        }
        let (of, jobs): (Vec<JobOf>, Vec<Job>) = jobs.jobs.into_iter().unzip();
        let forecast = Forecast {
            accounts: accounts.into_values().collect(),
            jobs,
            running,
        };
        let ends = forecast.ends(usize::try_from(slots).unwrap_or(1));
        Ok(places(&of, &ends, is_held, now))
    }

    /// What is left to play of evaluations that are under way, and how long such work took of late.
    #[boxed]
    pub async fn open_work(&self, now: Timestamp) -> Result<(Vec<OpenWork>, Measured)> {
        let mut tx = self.database.read.begin().await?;
        let open = measured::open(&mut tx).await?;
        let measured = measured::lately(&mut tx, &open, now).await?;
        let work = |open: &Open| OpenWork {
            of: open.of,
            team: open.team,
            episodes: open.episodes_left,
            shards: open.shards_left,
            max_faults: open.max_faults,
            expected_ms: episode_ms(open, &measured).map(|ms| ms * f64::from(open.episodes_left)),
        };
        Ok((open.iter().map(work).collect(), measured))
    }
}

/// The places among each sort.
fn places(of: &[JobOf], ends: &[End], is_held: bool, now: Timestamp) -> Outlook {
    let mut by_end: Vec<(&JobOf, &End)> = of.iter().zip(ends).collect();
    by_end.sort_by_key(|(_, end)| end.order);
    let count = |is_one: fn(&JobOf) -> bool| {
        let count = of.iter().filter(|of| is_one(of)).count();
        u32::try_from(count).unwrap_or(u32::MAX)
    };
    let submissions = count(|of| matches!(of, JobOf::Submission(_)));
    let evaluations = count(|of| matches!(of, JobOf::Evaluation(_)));
    let games = count(|of| matches!(of, JobOf::Game(_)));
    let mut outlook = Outlook::default();
    let expected_at = |end: &End| {
        let in_ms = end.in_ms.filter(|_| !is_held)?;
        let in_ms = SignedDuration::try_from_secs_f64(in_ms / 1000.0).ok()?;
        now.checked_add(in_ms).ok()
    };
    let mut place = [0, 0, 0];
    for (of, end) in by_end {
        let expected_at = expected_at(end);
        match of {
            JobOf::Submission(id) => {
                place[0] += 1;
                let place = QueuePlace {
                    place: place[0],
                    of: submissions,
                    expected_at,
                };
                outlook.submissions.insert(*id, place);
            }
            JobOf::Evaluation(id) => {
                place[1] += 1;
                let place = QueuePlace {
                    place: place[1],
                    of: evaluations,
                    expected_at,
                };
                outlook.evaluations.insert(*id, place);
            }
            JobOf::Game(id) => {
                place[2] += 1;
                let place = QueuePlace {
                    place: place[2],
                    of: games,
                    expected_at,
                };
                outlook.games.insert(*id, place);
            }
            JobOf::Nobody => {}
        }
    }
    outlook
}
