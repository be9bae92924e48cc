//! The section of *baselines* on the pages of the boards: reference agents of the organisers, which are evaluated but not ranked.

use super::format::{self, Rate};
use faceoff_api::views::{baseline::BaselineRow, board::BoardView};
use faceoff_types::{EvaluationId, Task, Tier};
use jiff::civil::Date;

pub(super) struct Baseline {
    /// Rank that the agent would have among the teams.
    pub(super) hypothetical_rank: u32,
    pub(super) team: String,
    pub(super) agent: Option<String>,
    pub(super) evaluation: EvaluationId,
    pub(super) day: Date,
    /// `None` in a competition without tiers.
    pub(super) tier: Option<Tier>,
    /// Success rates of the tasks that the board covers and the agent played.
    pub(super) rates: Vec<(Task, Rate)>,
    pub(super) penalty_points: String,
    pub(super) score: String,
}

/// The reference agents of a board, in its order.
pub(super) fn rows(board: &BoardView) -> Vec<Baseline> {
    let row = |row: &BaselineRow| {
        let tasks = row
            .tasks
            .iter()
            .filter(|(task, _)| board.task.is_none_or(|only| only == **task));
        let points = match board.task.and_then(|task| row.tasks.get(&task)) {
            Some(result) => result.penalty_points,
            None => row.penalty_points,
        };
        Baseline {
            hypothetical_rank: row.hypothetical_rank,
            team: row.team.to_string(),
            agent: row.agent.clone(),
            evaluation: row.evaluation,
            day: row.day,
            tier: row.tier,
            rates: tasks
                .map(|(task, result)| (*task, Rate::new(result)))
                .collect(),
            penalty_points: format::one_decimal(points),
            score: format::one_decimal(row.score),
        }
    };
    board.baselines.iter().map(row).collect()
}
