//! The organisers' reference agents, in a section of their own on the boards' pages.

use super::figures::{self, Rate};
use faceoff_api::views::{baseline::BaselineRow, board::BoardView};
use faceoff_types::{EvaluationId, Task, Tier};
use jiff::civil::Date;

/// A row of the section.
pub(super) struct Baseline {
    pub(super) would_rank: u32,
    pub(super) team: String,
    pub(super) agent: Option<String>,
    pub(super) evaluation: EvaluationId,
    pub(super) day: Date,
    pub(super) tier: Tier,
    pub(super) sign: &'static str,
    /// Of the tasks that the board is about and that it played.
    pub(super) rates: Vec<(Task, Rate)>,
    pub(super) penalty_points: String,
    pub(super) score: String,
}

/// Of a board, in its order.
pub(super) fn of(board: &BoardView) -> Vec<Baseline> {
    let row = |row: &BaselineRow| {
        let of_board = row
            .tasks
            .iter()
            .filter(|(task, _)| board.task.is_none_or(|only| only == **task));
        let points = match board.task.and_then(|task| row.tasks.get(&task)) {
            Some(result) => result.penalty_points,
            None => row.penalty_points,
        };
        Baseline {
            would_rank: row.would_rank,
            team: row.team.to_string(),
            agent: row.agent.clone(),
            evaluation: row.evaluation,
            day: row.day,
            tier: row.tier,
            sign: figures::tier_sign(row.tier),
            rates: of_board
                .map(|(task, result)| (*task, Rate::of(result)))
                .collect(),
            penalty_points: figures::one(points),
            score: figures::one(row.score),
        }
    };
    board.baselines.iter().map(row).collect()
}
