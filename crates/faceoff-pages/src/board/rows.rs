//! Rows of a board as text, grouped by tier if the competition has tiers.

use super::score_history::{ScoreHistory, Sparkline};
use crate::{
    board_status::shared_rank,
    format::{self, Rate, TierLabel},
};
use faceoff_api::views::{
    board::{BoardRow, BoardView},
    task::TaskView,
};
use faceoff_service::views::board_timeline::EarlierBoard;
use faceoff_types::{Competition, DivisionName, EvaluationId, Task, TaskWeights, TeamId, Tier};
use jiff::civil;
use std::{cmp::Ordering, collections::BTreeMap};

/// Least shown probability that other episodes of the same kind would give another tier.
const MIN_SHOWN_TIER_CHANGE: f64 = 0.01;

/// The team of a row with its rank.
pub(super) struct TeamCell {
    /// The rank. Statistically tied teams share the rank of the first one, with `=`.
    pub(super) rank: String,
    /// Change since the day before, if the board has one.
    pub(super) change: Option<RankChange>,
    /// The first team of the *rank group*, the teams that are statistically tied; `None` for the first team itself and without a tie.
    pub(super) tied_with: Option<String>,
    /// The scores of the days; `None` with fewer than two.
    pub(super) sparkline: Option<Sparkline>,
    /// Probability of another tier; `None` below [`MIN_SHOWN_TIER_CHANGE`] and for means of several days.
    pub(super) tier_change: Option<String>,
    pub(super) team: String,
    pub(super) team_id: TeamId,
    pub(super) division: Option<DivisionName>,
    pub(super) agent: Option<String>,
    pub(super) evaluation: EvaluationId,
    pub(super) day: civil::Date,
    /// Reason of an extra evaluation.
    pub(super) extra_evaluation: Option<String>,
    pub(super) is_rerun_after_release: bool,
    /// Number of days in the mean, if there are several.
    pub(super) day_count: Option<usize>,
    /// Conditions of the evaluation, where they differ between rows.
    pub(super) conditions: Option<String>,
    /// The tier, where rows are not grouped by tier.
    pub(super) tier: Option<Tier>,
}

/// Change of a team's rank and score since the day before.
pub(super) struct RankChange {
    /// Visible text; empty if the rank is unchanged.
    pub(super) symbol: String,
    pub(super) class: &'static str,
    /// Text for screen readers.
    pub(super) description: String,
    /// Change of the score in percentage points; `None` for a new team and for an unchanged score.
    pub(super) score: Option<String>,
}

/// Rows of one tier; all rows if the board is not sorted by rank, and in a competition without tiers.
pub(super) struct Group<Row> {
    pub(super) tier: Option<TierLabel>,
    pub(super) rows: Vec<Row>,
}

/// Conditions of an evaluation. Results under different conditions are not comparable.
fn conditions(row: &BoardRow) -> String {
    format!(
        "perturbations of the profile “{}”, {} episodes per task, rules {}",
        row.profile,
        episodes_per_day(row),
        row.ruleset
    )
}

/// Largest number of episodes of a task per day.
fn episodes_per_day(row: &BoardRow) -> u32 {
    let episodes = row.tasks.values().map(|task| task.episodes);
    per_day(row, episodes.max().unwrap_or(0))
}

/// Episodes per day. A row may be the mean of several days, each with an evaluation.
fn per_day(row: &BoardRow, episodes: u32) -> u32 {
    let days = u32::try_from(row.evaluations.len()).unwrap_or(u32::MAX);
    episodes / days.max(1)
}

/// The conditions of all rows; `None` if they differ.
pub(super) fn common_conditions(rows: &[BoardRow]) -> Option<String> {
    let first = conditions(rows.first()?);
    rows.iter()
        .all(|row| conditions(row) == first)
        .then_some(first)
}

/// The board around a row: the other rows, and the board of the day before.
pub(super) struct Context<'a> {
    board: &'a BoardView,
    /// The board of the day before.
    earlier: Option<&'a EarlierBoard>,
    score_history: &'a ScoreHistory,
    has_common_conditions: bool,
    is_by_rank: bool,
    /// The first team of each rank group with several teams.
    leaders: BTreeMap<u32, TeamId>,
}

impl<'a> Context<'a> {
    /// `is_by_rank`: the board is sorted by rank. Only then are its rows grouped by tier.
    pub(super) fn new(
        board: &'a BoardView,
        earlier: Option<&'a EarlierBoard>,
        score_history: &'a ScoreHistory,
        is_by_rank: bool,
    ) -> Self {
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
            earlier,
            score_history,
            has_common_conditions: common_conditions(&board.rows).is_some(),
            is_by_rank,
            leaders: leaders.collect(),
        }
    }

    /// The name of the first team of the row's rank group; `None` for that team itself.
    fn tied_with(&self, row: &BoardRow) -> Option<String> {
        let leader = self.leaders.get(&row.rank_group)?;
        let rows = self.board.rows.iter();
        let mut others = rows.filter(|other| other.team_id != row.team_id);
        let leader = others.find(|other| other.team_id == *leader)?;
        Some(leader.team.to_string())
    }

    /// The change since the board of the day before; `None` without such a board.
    fn change(&self, row: &BoardRow) -> Option<RankChange> {
        let earlier = self.earlier?;
        let Some(previous) = earlier.rank_of(row.team_id) else {
            return Some(RankChange {
                symbol: "new".to_owned(),
                class: "new",
                description: format!(": not on the board of {}", earlier.day),
                score: None,
            });
        };
        let (symbol, class, places) = match row.rank.cmp(&previous.rank) {
            Ordering::Less => ("▲", "up", previous.rank - row.rank),
            Ordering::Greater => ("▼", "down", row.rank - previous.rank),
            Ordering::Equal => ("", "same", 0),
        };
        let score = match self.board.task.and_then(|task| row.tasks.get(&task)) {
            Some(result) => 100.0 * result.success_rate,
            None => row.score,
        };
        let score = format::signed(score - previous.score);
        Some(RankChange {
            symbol: match places {
                0 => String::new(),
                _ => format!("{symbol} {places}"),
            },
            class,
            description: format!(" {class} since {}", earlier.day),
            score: (score != "0.0").then_some(score),
        })
    }

    fn team_cell(&self, row: &BoardRow) -> TeamCell {
        let tier_change = row.tier_change_probability;
        TeamCell {
            rank: shared_rank(&self.board.rows, row),
            sparkline: self.score_history.sparkline(row.team_id),
            change: self.change(row),
            tied_with: self.tied_with(row),
            tier_change: tier_change
                .filter(|probability| *probability >= MIN_SHOWN_TIER_CHANGE)
                .map(format::probability),
            team: row.team.to_string(),
            team_id: row.team_id,
            division: row.division.clone(),
            agent: row.agent.clone(),
            evaluation: row.evaluation,
            day: row.day,
            extra_evaluation: row.extra_evaluation.clone(),
            is_rerun_after_release: row.rerun_after_release,
            day_count: (row.evaluations.len() > 1).then_some(row.evaluations.len()),
            conditions: (!self.has_common_conditions).then(|| conditions(row)),
            tier: row.tier.filter(|_| !self.is_by_rank),
        }
    }

    /// Groups the rows; tiers without a team are omitted.
    pub(super) fn groups<Row>(&self, row: impl Fn(&BoardRow) -> Row) -> Vec<Group<Row>> {
        let rows = &self.board.rows;
        let bounds = self.board.tier_bounds.filter(|_| self.is_by_rank);
        let mut groups: Vec<Group<Row>> = match bounds {
            Some(bounds) => {
                let tier_group = |tier: Tier| Group {
                    tier: Some(TierLabel::new(tier, &bounds)),
                    rows: rows
                        .iter()
                        .filter(|row| row.tier == Some(tier))
                        .map(&row)
                        .collect(),
                };
                Tier::ALL.into_iter().map(tier_group).collect()
            }
            None => vec![Group {
                tier: None,
                rows: rows.iter().map(&row).collect(),
            }],
        };
        groups.retain(|group| !group.rows.is_empty());
        groups
    }
}

/// A row of the overall board.
pub(super) struct OverallRow {
    pub(super) team: TeamCell,
    pub(super) score: Rate,
    /// In the competition's order; `None`: task not played.
    pub(super) rates: Vec<(Task, Option<Rate>)>,
    pub(super) penalty_points: String,
    pub(super) points_per_episode: String,
}

impl OverallRow {
    pub(super) fn new(
        row: &BoardRow,
        context: &Context,
        weights: &TaskWeights,
        competition: &Competition,
    ) -> Self {
        Self {
            team: context.team_cell(row),
            score: Rate::of_score(row.score, &row.tasks, weights),
            rates: competition
                .task_names()
                .map(|task| (task, row.tasks.get(&task).map(Rate::new)))
                .collect(),
            penalty_points: format::one_decimal(row.penalty_points),
            points_per_episode: format::points_per_episode(
                row.penalty_points,
                episodes_per_day(row),
            ),
        }
    }
}

/// A row of the board of a task.
pub(super) struct TaskRow {
    pub(super) team: TeamCell,
    pub(super) rate: Rate,
    pub(super) penalty_points: String,
    pub(super) points_per_episode: String,
    pub(super) details: Option<TaskDetails>,
}

/// Details that are public once the day is released.
pub(super) struct TaskDetails {
    /// Heading and number of episodes of each kind of violation.
    pub(super) violations: Vec<(String, u32)>,
    pub(super) mean_ms: String,
    pub(super) p99_ms: String,
    pub(super) max_ms: String,
}

impl TaskDetails {
    fn new(result: &TaskView, competition: &Competition) -> Option<Self> {
        let time = result.computation_time_s?;
        let counts = result.violations.as_ref()?;
        let kinds = competition.violations.iter();
        Some(Self {
            violations: kinds
                .map(|info| (info.column_heading.clone(), counts.get(info.name)))
                .collect(),
            mean_ms: format::milliseconds(time.mean),
            p99_ms: format::milliseconds(time.p99),
            max_ms: format::milliseconds(time.max),
        })
    }
}

impl TaskRow {
    pub(super) fn new(
        row: &BoardRow,
        result: &TaskView,
        context: &Context,
        competition: &Competition,
    ) -> Self {
        Self {
            team: context.team_cell(row),
            rate: Rate::new(result),
            penalty_points: format::one_decimal(result.penalty_points),
            points_per_episode: format::points_per_episode(
                result.penalty_points,
                per_day(row, result.episodes),
            ),
            details: TaskDetails::new(result, competition),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// A board with a row for each score; `tier` is that of all rows.
    fn board(scores: &[f64], tier: Option<Tier>) -> BoardView {
        let rows: Vec<Value> = (1..)
            .zip(scores)
            .map(|(rank, score)| {
                let id = format!("00000000-0000-0000-0000-00000000000{rank}");
                json!({
                    "rank": rank, "rank_group": rank, "tier": tier, "tier_change_probability": null,
                    "team": format!("Team {rank}"), "team_id": id, "agent": null, "evaluation": id, "evaluations": [id],
                    "day": "2026-03-01", "finished_at": "2026-03-01T06:30:00Z", "ruleset": "airhockey-2023.3",
                    "profile": "evaluation", "score": score, "penalty_points": 80.0, "released_at": null, "seed": null,
                    "tasks": {},
                })
            })
            .collect();
        let bounds = tier.map(|_| json!({"deployable": 0.5, "improvable": 1.5}));
        let board = json!({
            "stage": "00000000-0000-0000-0000-000000000009", "stage_name": "A stage", "revision": 1,
            "since": "2026-03-01T00:00:00Z", "ruleset": "airhockey-2023.3", "weights": {"hit": 1.0}, "tier_bounds": bounds,
            "standings": "latest", "rows_by": "latest", "blind": false, "provisional": true, "finalised": null, "task": null,
            "significance": 0.05, "tier_change_resamples": 2000, "disqualified": [], "rows": rows,
        });
        serde_json::from_value(board).unwrap()
    }

    /// The tier of each group, its teams, and the tiers in the cells of the teams.
    type TextGroup = (Option<Tier>, Vec<String>, Vec<Option<Tier>>);

    fn groups(board: &BoardView, is_by_rank: bool) -> Vec<TextGroup> {
        let score_history = ScoreHistory::default();
        let context = Context::new(board, None, &score_history, is_by_rank);
        let groups = context.groups(|row| context.team_cell(row));
        let summary = |group: Group<TeamCell>| {
            let teams = group.rows.iter().map(|cell| cell.team.clone()).collect();
            let tiers = group.rows.iter().map(|cell| cell.tier).collect();
            (group.tier.map(|label| label.tier), teams, tiers)
        };
        groups.into_iter().map(summary).collect()
    }

    #[test]
    fn board_without_tiers_is_one_group_without_heading() {
        let teams = || vec!["Team 1".to_owned(), "Team 2".to_owned()];
        for is_by_rank in [true, false] {
            assert_eq!(
                groups(&board(&[50.0, 40.0], None), is_by_rank),
                [(None, teams(), vec![None, None])]
            );
        }
        assert_eq!(groups(&board(&[], None), true), []);
        let tier = Some(Tier::Improvable);
        let with_tiers = board(&[50.0, 40.0], tier);
        assert_eq!(
            groups(&with_tiers, true),
            [(tier, teams(), vec![None, None])]
        );
        assert_eq!(
            groups(&with_tiers, false),
            [(None, teams(), vec![tier, tier])]
        );
    }
}
