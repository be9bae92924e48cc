//! Where the other boards of a page are: by the query that asked for this one, with a part of it changed.

use crate::query::asking;
use faceoff_api::requests::{BoardColumn, BoardPageQuery, BoardSort};
use jiff::civil::Date;

/// Path and query of a board's page.
pub(super) struct Address<'a> {
    path: String,
    query: &'a BoardPageQuery,
}

impl<'a> Address<'a> {
    pub(super) fn of(path: impl Into<String>, query: &'a BoardPageQuery) -> Self {
        Self {
            path: path.into(),
            query,
        }
    }

    /// The same board of another task, in board order.
    pub(super) fn at(&self, path: &str) -> String {
        written(path, self.query, self.query.day, None)
    }

    /// The board of a day; `None`: of now.
    pub(super) fn of_day(&self, day: Option<Date>) -> String {
        written(&self.path, self.query, day, self.query.sort)
    }

    /// Sorted by a column.
    pub(super) fn sorted(&self, sort: BoardSort) -> String {
        let is_usual = sort.column == BoardColumn::Place && !sort.is_reversed;
        let sort = (!is_usual).then_some(sort);
        written(&self.path, self.query, self.query.day, sort)
    }
}

fn written(
    path: &str,
    query: &BoardPageQuery,
    day: Option<Date>,
    sort: Option<BoardSort>,
) -> String {
    let query = BoardPageQuery {
        day,
        sort,
        ..query.clone()
    };
    asking(path, &query)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    #[test]
    fn a_link_keeps_what_was_asked_for_and_changes_a_part() {
        let query = BoardPageQuery {
            division: Some("Bachelor students".parse().unwrap()),
            day: Some(date(2026, 3, 2)),
            sort: Some(BoardSort {
                column: BoardColumn::Points,
                is_reversed: true,
            }),
            ..BoardPageQuery::default()
        };
        let address = Address::of("/tasks/hit", &query);
        assert_eq!(
            address.of_day(None),
            "/tasks/hit?division=Bachelor+students&sort=-points"
        );
        assert_eq!(
            address.at("/"),
            "/?division=Bachelor+students&day=2026-03-02"
        );
        let usual = BoardSort {
            column: BoardColumn::Place,
            is_reversed: false,
        };
        assert_eq!(
            address.sorted(usual),
            "/tasks/hit?division=Bachelor+students&day=2026-03-02"
        );
        let plain = BoardPageQuery::default();
        assert_eq!(Address::of("/", &plain).of_day(None), "/");
    }
}
