//! Addresses of other boards: those of the current page with another task, day or sort.

use crate::query::with_query;
use faceoff_api::requests::{BoardColumn, BoardPageQuery, BoardSort};
use jiff::civil::Date;

/// Path and query of the page of a board.
pub(super) struct Address<'a> {
    path: String,
    query: &'a BoardPageQuery,
}

impl<'a> Address<'a> {
    pub(super) fn new(path: impl Into<String>, query: &'a BoardPageQuery) -> Self {
        Self {
            path: path.into(),
            query,
        }
    }

    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// The board of another task, sorted by rank.
    pub(super) fn with_path(&self, path: &str) -> String {
        address(path, self.query, self.query.day, None)
    }

    /// The board of a day; `None`: the latest.
    pub(super) fn with_day(&self, day: Option<Date>) -> String {
        address(&self.path, self.query, day, self.query.sort)
    }

    pub(super) fn with_sort(&self, sort: BoardSort) -> String {
        let is_default = sort.column == BoardColumn::Rank && !sort.is_reversed;
        let sort = (!is_default).then_some(sort);
        address(&self.path, self.query, self.query.day, sort)
    }
}

fn address(
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
    with_query(path, &query)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    #[test]
    fn address_changes_one_part_of_the_query() {
        let query = BoardPageQuery {
            division: Some("Bachelor students".parse().unwrap()),
            day: Some(date(2026, 3, 2)),
            sort: Some(BoardSort {
                column: BoardColumn::Points,
                is_reversed: true,
            }),
            ..BoardPageQuery::default()
        };
        let address = Address::new("/tasks/hit", &query);
        assert_eq!(
            address.with_day(None),
            "/tasks/hit?division=Bachelor+students&sort=-points"
        );
        assert_eq!(
            address.with_path("/"),
            "/?division=Bachelor+students&day=2026-03-02"
        );
        let by_rank = BoardSort {
            column: BoardColumn::Rank,
            is_reversed: false,
        };
        assert_eq!(
            address.with_sort(by_rank),
            "/tasks/hit?division=Bachelor+students&day=2026-03-02"
        );
        let plain = BoardPageQuery::default();
        assert_eq!(Address::new("/", &plain).with_day(None), "/");
    }
}
