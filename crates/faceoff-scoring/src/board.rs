//! Boards: evaluations ranked by tier, score, penalty points and time of submission. A *tier* says how safe an agent is:
//! deployable, improvable or non-deployable. In a competition without tiers no row has one, and the score comes first.

use faceoff_types::{EvaluationResult, Task, Tier};
use std::cmp::Ordering;

/// An evaluation (one agent's run of all tasks) that a board ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardEntry<K> {
    /// Identifies the row for the caller.
    pub key: K,
    /// The evaluation's scores.
    pub result: EvaluationResult,
    /// Time of the submission in milliseconds since 1970: of rows that are equal otherwise, the earlier is first.
    pub submitted_at_ms: i64,
}

/// A row with its rank.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedEntry<K> {
    /// From 1 over the whole board, across tiers; ranks are unique.
    pub rank: u32,
    /// The tier that the row is listed under: the overall tier, or that of the task; `None` without tiers.
    pub tier: Option<Tier>,
    /// The evaluation.
    pub entry: BoardEntry<K>,
}

/// The sort key of a board.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoardKey {
    tier: Option<Tier>,
    score: f64,
    penalty_points: f64,
    submitted_at_ms: i64,
}

impl BoardKey {
    /// Rows with a number that is not finite are last in their tier. The scoring of this crate produces none.
    pub(crate) fn new(
        tier: Option<Tier>,
        score: f64,
        penalty_points: f64,
        submitted_at_ms: i64,
    ) -> Self {
        // Adding 0 turns −0 into 0: `total_cmp` distinguishes them.
        let finite_or = |number: f64, worst: f64| {
            if number.is_finite() {
                number + 0.0
            } else {
                worst
            }
        };
        Self {
            tier,
            score: finite_or(score, f64::NEG_INFINITY),
            penalty_points: finite_or(penalty_points, f64::INFINITY),
            submitted_at_ms,
        }
    }

    /// Better first: tier, then higher score, then lower penalty, then earlier submission.
    pub(crate) fn compare(&self, other: &Self) -> Ordering {
        self.tier
            .cmp(&other.tier)
            .then_with(|| other.score.total_cmp(&self.score))
            .then_with(|| self.penalty_points.total_cmp(&other.penalty_points))
            .then_with(|| self.submitted_at_ms.cmp(&other.submitted_at_ms))
    }
}

/// The overall board: tiers in order; inside a tier the higher score first, then the lower penalty,
/// then the earlier submission, then the order of `entries`.
#[must_use]
pub fn overall_board<K>(entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> {
    ranked(entries, |result| {
        Some((result.tier, result.score, result.penalty_points))
    })
}

/// The board of one task: as [`overall_board`], by the task's success rate, penalty and tier. Entries without the task
/// are left out.
#[must_use]
pub fn task_board<K>(task: Task, entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> {
    ranked(entries, |result| {
        let result = result.tasks.get(&task)?;
        Some((result.tier, result.success_rate, result.penalty_points))
    })
}

/// Ranks the entries. `sort_values` gives an entry's tier, score and penalty points, or `None` to leave the entry out.
fn ranked<K>(
    entries: Vec<BoardEntry<K>>,
    sort_values: impl Fn(&EvaluationResult) -> Option<(Option<Tier>, f64, f64)>,
) -> Vec<RankedEntry<K>> {
    let mut keyed: Vec<_> = entries
        .into_iter()
        .filter_map(|entry| {
            let (tier, score, penalty_points) = sort_values(&entry.result)?;
            Some((
                BoardKey::new(tier, score, penalty_points, entry.submitted_at_ms),
                entry,
            ))
        })
        .collect();
    keyed.sort_by(|(a, _), (b, _)| a.compare(b));
    (1..)
        .zip(keyed)
        .map(|(rank, (key, entry))| RankedEntry {
            rank,
            tier: key.tier,
            entry,
        })
        .collect()
}
