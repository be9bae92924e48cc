//! By which column a board is sorted, and the links that sort it by another.

use super::address::Address;
use faceoff_api::{
    requests::{BoardColumn, BoardPageQuery, BoardSort},
    views::board::BoardRow,
};
use faceoff_service::problem::{Problem, ProblemKind};
use faceoff_types::Task;
use std::cmp::Ordering;

/// The head of a column that a board can be sorted by.
pub(super) struct Head {
    pub(super) title: &'static str,
    /// What is below it, in a word.
    pub(super) unit: &'static str,
    pub(super) class: &'static str,
    /// Where the board is that is sorted by it; the other way round, if it is.
    pub(super) address: String,
    /// `ascending` or `descending`, if the board is sorted by it.
    pub(super) sorted: Option<&'static str>,
}

impl Head {
    pub(super) fn sign(&self) -> &'static str {
        match self.sorted {
            Some("ascending") => "▴",
            Some(_) => "▾",
            None => "",
        }
    }
}

/// The overall board's columns, or those of a task's.
fn columns(task: Option<Task>) -> Vec<(BoardColumn, &'static str, &'static str, &'static str)> {
    let place = (BoardColumn::Place, "#", "", "rank");
    let team = (BoardColumn::Team, "Team", "", "");
    let points = (BoardColumn::Points, "Penalty", "points", "number");
    match task {
        Some(_) => vec![
            place,
            team,
            (BoardColumn::Score, "Success", "percent", "number"),
            points,
        ],
        None => vec![
            place,
            team,
            (BoardColumn::Score, "Score", "percent", "number"),
            (BoardColumn::Task(Task::Hit), "Hit", "success", "number"),
            (
                BoardColumn::Task(Task::Defend),
                "Defend",
                "success",
                "number",
            ),
            (
                BoardColumn::Task(Task::Prepare),
                "Prepare",
                "success",
                "number",
            ),
            points,
        ],
    }
}

/// In which order the rows stand.
pub(super) struct Order {
    sort: BoardSort,
    pub(super) heads: Vec<Head>,
}

impl Order {
    /// # Errors
    /// `InvalidRequest` if the board has no such column.
    pub(super) fn of(
        query: &BoardPageQuery,
        task: Option<Task>,
        address: &Address,
    ) -> Result<Self, Problem> {
        let usual = BoardSort {
            column: BoardColumn::Place,
            is_reversed: false,
        };
        let sort = query.sort.unwrap_or(usual);
        let columns = columns(task);
        if !columns.iter().any(|(column, ..)| *column == sort.column) {
            return Err(Problem::new(
                ProblemKind::InvalidRequest,
                format!(
                    "this board has no column {:?} to be sorted by",
                    sort.column.as_str()
                ),
            ));
        }
        let head = |(column, title, unit, class)| {
            let is_sorted = sort.column == column;
            let ascends = ascends(column) != sort.is_reversed;
            let next = BoardSort {
                column,
                is_reversed: is_sorted && !sort.is_reversed,
            };
            Head {
                title,
                unit,
                class,
                address: address.sorted(next),
                sorted: is_sorted.then_some(if ascends { "ascending" } else { "descending" }),
            }
        };
        Ok(Self {
            sort,
            heads: columns.into_iter().map(head).collect(),
        })
    }

    /// Tier by tier, as the rules have it.
    pub(super) fn is_usual(&self) -> bool {
        self.sort.column == BoardColumn::Place && !self.sort.is_reversed
    }

    /// Rows of what is level keep their board order.
    pub(super) fn apply(&self, rows: &mut [BoardRow], task: Option<Task>) {
        rows.sort_by(|a, b| {
            let order = compared(self.sort.column, task, a, b);
            if self.sort.is_reversed {
                order.reverse()
            } else {
                order
            }
        });
    }
}

/// Do values rise down the column, if it is not the other way round?
const fn ascends(column: BoardColumn) -> bool {
    match column {
        BoardColumn::Place | BoardColumn::Team | BoardColumn::Points => true,
        BoardColumn::Score | BoardColumn::Task(_) => false,
    }
}

/// The better first.
fn compared(column: BoardColumn, task: Option<Task>, a: &BoardRow, b: &BoardRow) -> Ordering {
    let rate = |row: &BoardRow, task: Task| {
        let of_task = row.tasks.get(&task);
        of_task.map_or(f64::NEG_INFINITY, |result| result.success_rate)
    };
    let points = |row: &BoardRow| match task.and_then(|task| row.tasks.get(&task)) {
        Some(of_task) => of_task.penalty_points,
        None => row.penalty_points,
    };
    match (column, task) {
        (BoardColumn::Place, _) => a.rank.cmp(&b.rank),
        (BoardColumn::Team, _) => {
            let name = |row: &BoardRow| row.team.as_str().to_lowercase();
            name(a).cmp(&name(b))
        }
        (BoardColumn::Score, Some(task)) | (BoardColumn::Task(task), _) => {
            rate(b, task).total_cmp(&rate(a, task))
        }
        (BoardColumn::Score, None) => b.score.total_cmp(&a.score),
        (BoardColumn::Points, _) => points(a).total_cmp(&points(b)),
    }
}
