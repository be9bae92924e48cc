//! A board's rows in words, and the groups that they stand in.

use crate::figures::{self, Rate};
use faceoff_api::views::{
    board::{BoardRow, BoardView},
    task::TaskView,
};
use faceoff_service::views::trail::Before;
use faceoff_types::{DivisionName, EvaluationId, Task, TaskWeights, TeamId, Tier, ViolationCounts};
use jiff::civil;
use std::{cmp::Ordering, collections::BTreeMap};

/// A lower probability that the tier is luck is not worth a reader's time.
const NOTABLE_TIER_CHANGE: f64 = 0.01;

/// Who a row is about.
pub(super) struct Who {
    pub(super) rank: u32,
    /// Since the day before, if the board had one.
    pub(super) moved: Option<Moved>,
    /// Whom the episodes cannot tell it from, if that is another team.
    pub(super) level_with: Option<String>,
    /// Of the tier on this board; `None` where that hardly is luck, and of means.
    pub(super) tier_change: Option<String>,
    pub(super) team: String,
    pub(super) team_id: TeamId,
    pub(super) division: Option<DivisionName>,
    pub(super) agent: Option<String>,
    pub(super) evaluation: EvaluationId,
    pub(super) day: civil::Date,
    /// Why it is a turn beside the day's own.
    pub(super) extra_turn: Option<String>,
    /// How many days the row is a mean of, if of several.
    pub(super) days: Option<usize>,
    /// How it was evaluated, where the rows of the board differ in that.
    pub(super) setting: Option<String>,
    /// Its tier, where the row does not stand below it.
    pub(super) tier: Option<TierWords>,
}

/// Where a team has gone since the day before.
pub(super) struct Moved {
    /// For the eye; empty of who stands where they stood.
    pub(super) sign: String,
    pub(super) class: &'static str,
    pub(super) told: String,
    /// By how many percentage points its score has changed; `None` of a new one, and of one that did not.
    pub(super) score: Option<String>,
}

pub(super) struct TierWords {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) sign: &'static str,
    pub(super) bounds: String,
}

/// Rows below a tier's name; or all, where they are sorted by something else.
pub(super) struct Group<Row> {
    pub(super) tier: Option<TierWords>,
    pub(super) rows: Vec<Row>,
}

/// How a result came about; results of different settings do not compare.
fn setting(row: &BoardRow) -> String {
    format!(
        "{} profile, {} episodes per task, rules {}",
        row.profile,
        episodes(row),
        row.ruleset
    )
}

/// Of the task with the most, on a day.
fn episodes(row: &BoardRow) -> u32 {
    let episodes = row.tasks.values().map(|task| task.episodes);
    of_a_day(row, episodes.max().unwrap_or(0))
}

/// Episodes of a day, of those of all that the row is made of.
fn of_a_day(row: &BoardRow, episodes: u32) -> u32 {
    let days = u32::try_from(row.evaluations.len()).unwrap_or(u32::MAX);
    episodes / days.max(1)
}

/// The setting of the whole board; `None` where its rows differ.
pub(super) fn common_setting(rows: &[BoardRow]) -> Option<String> {
    let first = setting(rows.first()?);
    rows.iter()
        .all(|row| setting(row) == first)
        .then_some(first)
}

/// What of a row is said by comparing it with others.
pub(super) struct Context<'a> {
    board: &'a BoardView,
    before: Option<&'a Before>,
    has_common_setting: bool,
    is_usual: bool,
    /// Of rank groups with more than one team the first.
    leaders: BTreeMap<u32, TeamId>,
}

impl<'a> Context<'a> {
    /// `is_usual`: the rows stand tier by tier.
    pub(super) fn of(board: &'a BoardView, before: Option<&'a Before>, is_usual: bool) -> Self {
        let mut groups: BTreeMap<u32, Vec<&BoardRow>> = BTreeMap::new();
        for row in &board.rows {
            groups.entry(row.rank_group).or_default().push(row);
        }
        groups.retain(|_, rows| rows.len() > 1);
        let leaders = groups.into_iter().filter_map(|(group, rows)| {
            let first = rows.into_iter().min_by_key(|row| row.rank)?;
            Some((group, first.team_id))
        });
        Self {
            board,
            before,
            has_common_setting: common_setting(&board.rows).is_some(),
            is_usual,
            leaders: leaders.collect(),
        }
    }

    /// Are there teams that cannot be told apart?
    pub(super) fn has_groups(&self) -> bool {
        !self.leaders.is_empty()
    }

    fn level_with(&self, row: &BoardRow) -> Option<String> {
        let leader = self.leaders.get(&row.rank_group)?;
        let rows = self.board.rows.iter();
        let mut others = rows.filter(|other| other.team_id != row.team_id);
        let leader = others.find(|other| other.team_id == *leader)?;
        Some(leader.team.to_string())
    }

    fn moved(&self, row: &BoardRow) -> Option<Moved> {
        let before = self.before?;
        let Some(stood) = before.stood(row.team_id) else {
            return Some(Moved {
                sign: "new".to_owned(),
                class: "new",
                told: format!(": not on the board of {}", before.day),
                score: None,
            });
        };
        let (sign, class, places) = match row.rank.cmp(&stood.rank) {
            Ordering::Less => ("▲", "up", stood.rank - row.rank),
            Ordering::Greater => ("▼", "down", row.rank - stood.rank),
            Ordering::Equal => ("", "same", 0),
        };
        let score = match self.board.task.and_then(|task| row.tasks.get(&task)) {
            Some(of_task) => 100.0 * of_task.success_rate,
            None => row.score,
        };
        let score = figures::signed(score - stood.score);
        Some(Moved {
            sign: match places {
                0 => String::new(),
                _ => format!("{sign} {places}"),
            },
            class,
            told: format!(" {class} since {}", before.day),
            score: (score != "0.0").then_some(score),
        })
    }

    fn who(&self, row: &BoardRow) -> Who {
        let change = row.tier_change_probability;
        Who {
            rank: row.rank,
            moved: self.moved(row),
            level_with: self.level_with(row),
            tier_change: change
                .filter(|chance| *chance >= NOTABLE_TIER_CHANGE)
                .map(figures::chance),
            team: row.team.to_string(),
            team_id: row.team_id,
            division: row.division.clone(),
            agent: row.agent.clone(),
            evaluation: row.evaluation,
            day: row.day,
            extra_turn: row.extra_turn.clone(),
            days: (row.evaluations.len() > 1).then_some(row.evaluations.len()),
            setting: (!self.has_common_setting).then(|| setting(row)),
            tier: (!self.is_usual).then(|| self.tier(row.tier)),
        }
    }

    fn tier(&self, tier: Tier) -> TierWords {
        TierWords {
            name: tier.as_str(),
            title: tier.title(),
            sign: figures::tier_sign(tier),
            bounds: figures::tier_bounds(tier, &self.board.tier_bounds),
        }
    }

    /// Tiers without a team are left out.
    pub(super) fn groups<Row>(&self, row: impl Fn(&BoardRow) -> Row) -> Vec<Group<Row>> {
        let rows = &self.board.rows;
        let mut groups: Vec<Group<Row>> = if self.is_usual {
            let of_tier = |tier: Tier| Group {
                tier: Some(self.tier(tier)),
                rows: rows
                    .iter()
                    .filter(|row| row.tier == tier)
                    .map(&row)
                    .collect(),
            };
            Tier::ALL.into_iter().map(of_tier).collect()
        } else {
            vec![Group {
                tier: None,
                rows: rows.iter().map(&row).collect(),
            }]
        };
        groups.retain(|group| !group.rows.is_empty());
        groups
    }
}

/// A row of the overall board.
pub(super) struct OverallRow {
    pub(super) who: Who,
    pub(super) score: Rate,
    /// In the order of `Task::ALL`; `None` where the task was not played.
    pub(super) rates: Vec<(Task, Option<Rate>)>,
    pub(super) penalty_points: String,
    pub(super) per_episode: String,
}

impl OverallRow {
    pub(super) fn of(row: &BoardRow, context: &Context, weights: &TaskWeights) -> Self {
        Self {
            who: context.who(row),
            score: Rate::of_score(row.score, &row.tasks, weights),
            rates: Task::ALL
                .into_iter()
                .map(|task| (task, row.tasks.get(&task).map(Rate::of)))
                .collect(),
            penalty_points: figures::one(row.penalty_points),
            per_episode: figures::per_episode(row.penalty_points, episodes(row)),
        }
    }
}

/// A row of a task's board.
pub(super) struct TaskRow {
    pub(super) who: Who,
    pub(super) rate: Rate,
    pub(super) penalty_points: String,
    pub(super) per_episode: String,
    pub(super) details: Option<TaskDetails>,
}

/// What is told of a row once its day is released.
pub(super) struct TaskDetails {
    pub(super) violations: ViolationCounts,
    pub(super) mean_ms: String,
    pub(super) p99_ms: String,
    pub(super) max_ms: String,
}

impl TaskDetails {
    fn of(result: &TaskView) -> Option<Self> {
        let time = result.computation_time_s?;
        Some(Self {
            violations: result.violations?,
            mean_ms: figures::milliseconds(time.mean),
            p99_ms: figures::milliseconds(time.p99),
            max_ms: figures::milliseconds(time.max),
        })
    }
}

impl TaskRow {
    pub(super) fn of(row: &BoardRow, result: &TaskView, context: &Context) -> Self {
        Self {
            who: context.who(row),
            rate: Rate::of(result),
            penalty_points: figures::one(result.penalty_points),
            per_episode: figures::per_episode(
                result.penalty_points,
                of_a_day(row, result.episodes),
            ),
            details: TaskDetails::of(result),
        }
    }
}
