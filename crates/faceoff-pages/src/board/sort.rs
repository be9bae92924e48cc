//! Sorting of a board: the column and the direction, with links to sort by another column.

use super::address::Address;
use faceoff_api::{
    requests::{BoardColumn, BoardPageQuery, BoardSort},
    views::board::BoardRow,
};
use faceoff_service::problem::{Problem, ProblemKind};
use faceoff_types::{Competition, Task};
use std::cmp::Ordering;

/// Head of a sortable column.
pub(super) struct SortableColumn {
    pub(super) title: String,
    /// Unit of the column; empty without one.
    pub(super) unit: &'static str,
    pub(super) class: &'static str,
    /// Id of the element that explains it (`board_about.html`); `None` if the title does.
    pub(super) about: Option<String>,
    /// The board sorted by this column; in the other direction if it is already.
    pub(super) address: String,
    /// `ascending` or `descending` if the board is sorted by this column; the value of `aria-sort`.
    pub(super) direction: Option<&'static str>,
}

impl SortableColumn {
    pub(super) fn symbol(&self) -> &'static str {
        match self.direction {
            Some("ascending") => "▴",
            Some(_) => "▾",
            None => "",
        }
    }
}

/// Columns of the overall board, or of the board of a task: column, title, unit, CSS class.
fn columns(
    competition: &Competition,
    task: Option<Task>,
) -> Vec<(BoardColumn, &str, &'static str, &'static str)> {
    let (score, tasks) = match task {
        Some(_) => ("Success", &[][..]),
        None => ("Score", &competition.tasks[..]),
    };
    let mut columns = vec![
        (BoardColumn::Rank, "#", "", "rank"),
        (BoardColumn::Team, "Team", "", ""),
        (BoardColumn::Score, score, "percent", "number"),
    ];
    columns.extend(tasks.iter().map(|info| {
        let column = BoardColumn::Task(info.task);
        (column, info.title.as_str(), "success", "number")
    }));
    let unit = match task {
        Some(_) => "points",
        None => "points, worst task",
    };
    columns.push((BoardColumn::Points, "Penalty", unit, "number"));
    columns
}

/// The sort of a board, with its sortable columns.
pub(super) struct Sort {
    key: BoardSort,
    pub(super) columns: Vec<SortableColumn>,
}

impl Sort {
    /// # Errors
    /// `InvalidRequest` if the board has no such column.
    pub(super) fn new(
        query: &BoardPageQuery,
        task: Option<Task>,
        address: &Address,
        competition: &Competition,
    ) -> Result<Self, Problem> {
        let by_rank = BoardSort {
            column: BoardColumn::Rank,
            is_reversed: false,
        };
        let key = query.sort.unwrap_or(by_rank);
        let columns = columns(competition, task);
        if !columns.iter().any(|(column, ..)| *column == key.column) {
            return Err(Problem::new(
                ProblemKind::InvalidRequest,
                format!("this board cannot be sorted by {:?}", key.column.as_str()),
            ));
        }
        let sortable = |(column, title, unit, class): (BoardColumn, &str, _, _)| {
            let is_sorted = key.column == column;
            let is_ascending = is_ascending_by_default(column) != key.is_reversed;
            let sort = BoardSort {
                column,
                is_reversed: is_sorted && !key.is_reversed,
            };
            SortableColumn {
                title: title.to_owned(),
                unit,
                class,
                about: (column != BoardColumn::Team).then(|| format!("about-{}", column.as_str())),
                address: address.with_sort(sort),
                direction: is_sorted.then_some(if is_ascending {
                    "ascending"
                } else {
                    "descending"
                }),
            }
        };
        Ok(Self {
            key,
            columns: columns.into_iter().map(sortable).collect(),
        })
    }

    /// Is it the default sort: by rank, the first rank on top? Only then are rows grouped by tier.
    pub(super) fn is_by_rank(&self) -> bool {
        self.key.column == BoardColumn::Rank && !self.key.is_reversed
    }

    /// Equal rows keep the order of the board.
    pub(super) fn apply(&self, rows: &mut [BoardRow], task: Option<Task>) {
        rows.sort_by(|a, b| {
            let order = compare(self.key.column, task, a, b);
            if self.key.is_reversed {
                order.reverse()
            } else {
                order
            }
        });
    }
}

const fn is_ascending_by_default(column: BoardColumn) -> bool {
    match column {
        BoardColumn::Rank | BoardColumn::Team | BoardColumn::Points => true,
        BoardColumn::Score | BoardColumn::Task(_) => false,
    }
}

/// Compares by a column; better values come first.
fn compare(column: BoardColumn, task: Option<Task>, a: &BoardRow, b: &BoardRow) -> Ordering {
    let rate = |row: &BoardRow, task: Task| {
        let result = row.tasks.get(&task);
        result.map_or(f64::NEG_INFINITY, |result| result.success_rate)
    };
    let points = |row: &BoardRow| match task.and_then(|task| row.tasks.get(&task)) {
        Some(result) => result.penalty_points,
        None => row.penalty_points,
    };
    match (column, task) {
        (BoardColumn::Rank, _) => a.rank.cmp(&b.rank),
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
