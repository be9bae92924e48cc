//! A team's days: where it stands, how it came there, and what it broke.

use crate::{
    chart::{Bound, Panel, Value},
    figures::{self, Rate},
};
use faceoff_api::views::history::HistoryRow;
use faceoff_types::{EvaluationId, Task, Tier, TierBounds, Variation, ViolationCounts};
use jiff::civil::Date;

/// Where it stands by its newest day.
pub(super) struct Now {
    /// None of a reference agent.
    pub(super) rank: Option<u32>,
    pub(super) day: Date,
    pub(super) tier: Tier,
    pub(super) sign: &'static str,
    pub(super) bounds: String,
    pub(super) score: String,
    pub(super) penalty_points: String,
    pub(super) evaluation: EvaluationId,
}

impl Now {
    pub(super) fn of(row: &HistoryRow, bounds: &TierBounds) -> Self {
        Self {
            rank: row.rank,
            day: row.day,
            tier: row.tier,
            sign: figures::tier_sign(row.tier),
            bounds: figures::tier_bounds(row.tier, bounds),
            score: figures::one(row.score),
            penalty_points: figures::one(row.penalty_points),
            evaluation: row.evaluation,
        }
    }
}

/// A row of the table of days.
pub(super) struct Day {
    pub(super) day: Date,
    pub(super) evaluation: EvaluationId,
    pub(super) rank: Option<u32>,
    pub(super) tier: Tier,
    pub(super) sign: &'static str,
    pub(super) score: String,
    pub(super) score_low: String,
    pub(super) score_high: String,
    /// In the order of `Task::ALL`; `None` where the task was not played.
    pub(super) rates: Vec<Option<Rate>>,
    pub(super) penalty_points: String,
    pub(super) per_episode: String,
}

impl Day {
    pub(super) fn of(row: &HistoryRow, variation: &Variation) -> Self {
        let [low, high] = figures::score_interval(row.score, &row.tasks, &variation.weights);
        Self {
            day: row.day,
            evaluation: row.evaluation,
            rank: row.rank,
            tier: row.tier,
            sign: figures::tier_sign(row.tier),
            score: figures::one(row.score),
            score_low: figures::one(low),
            score_high: figures::one(high),
            rates: Task::ALL
                .into_iter()
                .map(|task| row.tasks.get(&task).map(Rate::of))
                .collect(),
            penalty_points: figures::one(row.penalty_points),
            per_episode: format!("{:.2}", points_per_episode(row)),
        }
    }
}

/// Of the task with the most points an episode, which decides the tier.
fn points_per_episode(row: &HistoryRow) -> f64 {
    let of_tasks = row.tasks.values();
    of_tasks
        .map(|task| task.penalty_points / f64::from(task.episodes.max(1)))
        .fold(0.0, f64::max)
}

/// Score, points and each task's success, over the same days.
pub(super) fn panels(rows: &[HistoryRow], variation: &Variation) -> Vec<Panel> {
    let of_row = |row: &HistoryRow, value, interval| Value {
        day: row.day,
        value,
        interval,
    };
    let score = rows.iter().map(|row| {
        let interval = figures::score_interval(row.score, &row.tasks, &variation.weights);
        of_row(row, row.score, Some(interval))
    });
    let points = rows
        .iter()
        .map(|row| of_row(row, points_per_episode(row), None));
    let (score, points): (Vec<_>, Vec<_>) = (score.collect(), points.collect());
    let bounds = [
        Bound {
            name: "deployable up to here",
            value: variation.tier_bounds.deployable().as_f64(),
        },
        Bound {
            name: "improvable up to here",
            value: variation.tier_bounds.improvable().as_f64(),
        },
    ];
    let mut panels = vec![
        Panel::of_percent("Score", &score),
        Panel::from_zero(
            "Penalty points",
            "per episode, the worst task",
            &points,
            &bounds,
        ),
    ];
    for (task, title) in [
        (Task::Hit, "Hit"),
        (Task::Defend, "Defend"),
        (Task::Prepare, "Prepare"),
    ] {
        let rates = rows.iter().filter_map(|row| {
            let result = row.tasks.get(&task)?;
            let interval = result.success_ci95.map(|end| 100.0 * end);
            Some(of_row(row, 100.0 * result.success_rate, Some(interval)))
        });
        let rates: Vec<_> = rates.collect();
        if !rates.is_empty() {
            panels.push(Panel::of_percent(title, &rates));
        }
    }
    panels
}

/// What a task's episodes broke, on all days that have come out.
pub(super) struct Broken {
    pub(super) task: Task,
    pub(super) episodes: u32,
    /// As the head of the table has them: end effector, elbow and wrist, joint position, joint velocity, time.
    pub(super) kinds: [String; 5],
}

/// Task by task; those without a violation are left out, and all are if there is none.
pub(super) fn broken(rows: &[HistoryRow]) -> Vec<Broken> {
    let of = |task: Task| {
        let told = rows.iter().filter_map(|row| row.tasks.get(&task));
        let told: Vec<(u32, ViolationCounts)> = told
            .filter_map(|result| Some((result.episodes, result.violations?)))
            .collect();
        let episodes = told.iter().map(|(episodes, _)| episodes).sum();
        let sum = |kind: fn(&ViolationCounts) -> u32| -> u32 {
            told.iter().map(|(_, counts)| kind(counts)).sum()
        };
        let kinds = [
            sum(|of| of.ee),
            sum(|of| of.link),
            sum(|of| of.joint_pos),
            sum(|of| of.joint_vel),
            sum(|of| of.computation_time),
        ];
        kinds.iter().any(|count| *count > 0).then(|| Broken {
            task,
            episodes,
            kinds: kinds.map(|count| figures::share(count, episodes)),
        })
    };
    Task::ALL.into_iter().filter_map(of).collect()
}
