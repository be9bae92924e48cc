//! Results of a team by day: the latest result, charts, and violations.

use crate::{
    chart::{Bound, DayChart, DayValue},
    format::{self, Rate, TierLabel},
};
use faceoff_api::views::history::HistoryRow;
use faceoff_types::{
    Competition, EvaluationId, Task, Tier, TierBounds, Variation, ViolationCounts,
};
use jiff::civil::Date;

/// The latest result.
pub(super) struct LatestResult {
    /// `None` for a reference agent.
    pub(super) rank: Option<u32>,
    pub(super) day: Date,
    /// `None` in a competition without tiers.
    pub(super) tier: Option<TierLabel>,
    pub(super) score: String,
    pub(super) penalty_points: String,
    pub(super) evaluation: EvaluationId,
}

impl LatestResult {
    pub(super) fn new(row: &HistoryRow, bounds: Option<TierBounds>) -> Self {
        Self {
            rank: row.rank,
            day: row.day,
            tier: row
                .tier
                .zip(bounds)
                .map(|(tier, bounds)| TierLabel::new(tier, &bounds)),
            score: format::one_decimal(row.score),
            penalty_points: format::one_decimal(row.penalty_points),
            evaluation: row.evaluation,
        }
    }
}

/// A row of the table of days.
pub(super) struct DayResult {
    pub(super) day: Date,
    pub(super) evaluation: EvaluationId,
    pub(super) rank: Option<u32>,
    /// `None` in a competition without tiers.
    pub(super) tier: Option<Tier>,
    pub(super) score: String,
    pub(super) score_low: String,
    pub(super) score_high: String,
    /// In the competition's order; `None`: task not played.
    pub(super) rates: Vec<Option<Rate>>,
    pub(super) penalty_points: String,
    pub(super) points_per_episode: String,
}

impl DayResult {
    pub(super) fn new(row: &HistoryRow, variation: &Variation, competition: &Competition) -> Self {
        let weights = competition.weights(variation);
        let [low, high] = format::score_interval(row.score, &row.tasks, &weights);
        Self {
            day: row.day,
            evaluation: row.evaluation,
            rank: row.rank,
            tier: row.tier,
            score: format::one_decimal(row.score),
            score_low: format::one_decimal(low),
            score_high: format::one_decimal(high),
            rates: competition
                .task_names()
                .map(|task| row.tasks.get(&task).map(Rate::new))
                .collect(),
            penalty_points: format::one_decimal(row.penalty_points),
            points_per_episode: format!("{:.2}", points_per_episode(row)),
        }
    }
}

/// Points per episode of the worst task, which decides the tier.
fn points_per_episode(row: &HistoryRow) -> f64 {
    row.tasks
        .values()
        .map(|task| task.penalty_points / f64::from(task.episodes.max(1)))
        .fold(0.0, f64::max)
}

/// Charts of score, penalty points and the success rate of each task, over the same days.
pub(super) fn charts(
    rows: &[HistoryRow],
    variation: &Variation,
    competition: &Competition,
) -> Vec<DayChart> {
    let day_value = |row: &HistoryRow, value, interval| DayValue {
        day: row.day,
        value,
        interval,
    };
    let weights = competition.weights(variation);
    let score = rows.iter().map(|row| {
        let interval = format::score_interval(row.score, &row.tasks, &weights);
        day_value(row, row.score, Some(interval))
    });
    let points = rows
        .iter()
        .map(|row| day_value(row, points_per_episode(row), None));
    let (score, points): (Vec<_>, Vec<_>) = (score.collect(), points.collect());
    let bounds = competition.tier_bounds(variation).map(|bounds| {
        [
            Bound {
                name: "limit of deployable",
                value: bounds.deployable().as_f64(),
            },
            Bound {
                name: "limit of improvable",
                value: bounds.improvable().as_f64(),
            },
        ]
    });
    let mut charts = vec![
        DayChart::from_percent("Score", &score),
        DayChart::from_zero(
            "Penalty points",
            "per episode, the worst task",
            &points,
            bounds.as_ref().map_or(&[], |bounds| &bounds[..]),
        ),
    ];
    for info in &competition.tasks {
        let rates = rows.iter().filter_map(|row| {
            let result = row.tasks.get(&info.task)?;
            let interval = result.success_ci95.map(|end| 100.0 * end);
            Some(day_value(row, 100.0 * result.success_rate, Some(interval)))
        });
        let rates: Vec<_> = rates.collect();
        if !rates.is_empty() {
            charts.push(DayChart::from_percent(&info.title, &rates));
        }
    }
    charts
}

/// Episodes of a task with violations, over all released days.
pub(super) struct TaskViolations {
    pub(super) task: Task,
    pub(super) episodes: u32,
    /// For each kind of violation of the competition, in its order: the number of episodes with one, and their share.
    pub(super) kinds: Vec<String>,
}

/// Violations by task; tasks without violations are omitted.
pub(super) fn violations(rows: &[HistoryRow], competition: &Competition) -> Vec<TaskViolations> {
    let task_violations = |task: Task| {
        let results = rows.iter().filter_map(|row| row.tasks.get(&task));
        let mut episodes = 0;
        let mut counts = ViolationCounts::default();
        for result in results {
            if let Some(violations) = &result.violations {
                episodes += result.episodes;
                counts.add(violations);
            }
        }
        let kinds = competition.violations.iter();
        let kinds = kinds.map(|info| counts.get(info.name));
        kinds
            .clone()
            .any(|count| count > 0)
            .then(|| TaskViolations {
                task,
                episodes,
                kinds: kinds
                    .map(|count| format::count_with_share(count, episodes))
                    .collect(),
            })
    };
    competition
        .task_names()
        .filter_map(task_violations)
        .collect()
}
