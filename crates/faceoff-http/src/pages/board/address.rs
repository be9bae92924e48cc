//! Where the other boards of a page are: by the query that asked for this one, with a part of it changed.

use crate::requests::{BoardColumn, BoardPageQuery, BoardSort};
use jiff::civil::Date;
use std::fmt::Write;

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
    let parts = [
        ("stage", query.stage.map(|stage| stage.to_string())),
        (
            "revision",
            query.revision.map(|revision| revision.to_string()),
        ),
        (
            "division",
            query.division.as_ref().map(|name| encoded(name.as_str())),
        ),
        ("day", day.map(|day| day.to_string())),
        ("by", query.by.map(|by| by.as_str().to_owned())),
        ("live", query.live.then(|| "true".to_owned())),
        (
            "sort",
            sort.map(|sort| {
                let sign = if sort.is_reversed { "-" } else { "" };
                format!("{sign}{}", sort.column.as_str())
            }),
        ),
    ];
    let mut address = path.to_owned();
    let mut sign = '?';
    for (name, value) in parts {
        if let Some(value) = value {
            address.push(sign);
            address.push_str(name);
            address.push('=');
            address.push_str(&value);
            sign = '&';
        }
    }
    address
}

/// As a query has it.
fn encoded(text: &str) -> String {
    let mut encoded = String::new();
    for byte in text.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                encoded.push(char::from(byte));
            }
            _ => {
                // A string takes all that is written to it.
                let _ = write!(encoded, "%{byte:02X}");
            }
        }
    }
    encoded
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
            "/tasks/hit?division=Bachelor%20students&sort=-points"
        );
        assert_eq!(
            address.at("/"),
            "/?division=Bachelor%20students&day=2026-03-02"
        );
        let usual = BoardSort {
            column: BoardColumn::Place,
            is_reversed: false,
        };
        assert_eq!(
            address.sorted(usual),
            "/tasks/hit?division=Bachelor%20students&day=2026-03-02"
        );
        let plain = BoardPageQuery::default();
        assert_eq!(Address::of("/", &plain).of_day(None), "/");
    }
}
