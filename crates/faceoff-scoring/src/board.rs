use faceoff_types::{EvaluationResult, Task, Tier};
use std::cmp::Ordering;

/// One candidate row of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardEntry<K> {
    /// What the caller identifies the row by.
    pub key: K,
    /// The evaluation's score.
    pub result: EvaluationResult,
    /// When the agent was submitted, milliseconds since 1970: the earlier one wins a full tie.
    pub submitted_at_ms: i64,
}

/// A row in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct RankedEntry<K> {
    /// From 1 over the whole board, through the tiers; no rank is given twice.
    pub rank: u32,
    /// The tier under which the row stands: overall, or of the task.
    pub tier: Tier,
    /// The row.
    pub entry: BoardEntry<K>,
}

/// What decides a row's place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placing {
    tier: Tier,
    score: f64,
    penalty_points: f64,
    submitted_at_ms: i64,
}

impl Placing {
    /// A number that is not finite (none comes out of this crate's scoring) takes the last place of
    /// its tier instead of an arbitrary one.
    pub(crate) fn new(tier: Tier, score: f64, penalty_points: f64, submitted_at_ms: i64) -> Self {
        // Adding 0 turns −0 into 0, which the total order of floats would tell apart.
        let or = |number: f64, last: f64| {
            if number.is_finite() {
                number + 0.0
            } else {
                last
            }
        };
        Self {
            tier,
            score: or(score, f64::NEG_INFINITY),
            penalty_points: or(penalty_points, f64::INFINITY),
            submitted_at_ms,
        }
    }

    /// Better first: tier, then higher score, then lower penalty, then earlier submission.
    pub(crate) fn board_order(&self, other: &Self) -> Ordering {
        self.tier
            .cmp(&other.tier)
            .then_with(|| other.score.total_cmp(&self.score))
            .then_with(|| self.penalty_points.total_cmp(&other.penalty_points))
            .then_with(|| self.submitted_at_ms.cmp(&other.submitted_at_ms))
    }
}

/// The overall board: tiers in order; inside a tier the higher score first, then the lower penalty,
/// then the earlier submission, then the order in which the entries were given.
#[must_use]
pub fn overall_board<K>(entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> {
    ranked(entries, |result| {
        Some((result.tier, result.score, result.penalty_points))
    })
}

/// The board of one task: as [`overall_board`], by the task's success rate, penalty and tier. Entries
/// that did not play the task are left out.
#[must_use]
pub fn task_board<K>(task: Task, entries: Vec<BoardEntry<K>>) -> Vec<RankedEntry<K>> {
    ranked(entries, |result| {
        let result = result.tasks.get(&task)?;
        Some((result.tier, result.success_rate, result.penalty_points))
    })
}

fn ranked<K>(
    entries: Vec<BoardEntry<K>>,
    by: impl Fn(&EvaluationResult) -> Option<(Tier, f64, f64)>,
) -> Vec<RankedEntry<K>> {
    let mut placed: Vec<_> = entries
        .into_iter()
        .filter_map(|entry| {
            let (tier, score, penalty_points) = by(&entry.result)?;
            Some((
                Placing::new(tier, score, penalty_points, entry.submitted_at_ms),
                entry,
            ))
        })
        .collect();
    placed.sort_by(|(a, _), (b, _)| a.board_order(b));
    (1..)
        .zip(placed)
        .map(|(rank, (placing, entry))| RankedEntry {
            rank,
            tier: placing.tier,
            entry,
        })
        .collect()
}
