//! From day to day.

use super::address::Address;
use faceoff_api::views::board::BoardView;
use faceoff_service::views::trail::Trail;
use jiff::civil::Date;

/// The days of a board, the shown one among them.
pub(super) struct Days {
    /// By the results of the days up to this one; `None` before the first.
    pub(super) shown: Option<Date>,
    /// It is an earlier one than the newest.
    pub(super) is_past: bool,
    pub(super) earlier: Option<Day>,
    pub(super) later: Option<Day>,
    /// The newer first.
    pub(super) all: Vec<Day>,
}

/// A day, and where its board is.
pub(super) struct Day {
    pub(super) day: Date,
    pub(super) address: String,
    pub(super) is_shown: bool,
}

impl Days {
    pub(super) fn of(board: &BoardView, trail: &Trail, address: &Address) -> Self {
        let newest = trail.days.last().copied();
        let shown = board.day.or(newest);
        // The newest is shown without naming it, so that who stays there sees the next one.
        let day = |day: Date| Day {
            day,
            address: address.of_day((Some(day) != newest).then_some(day)),
            is_shown: Some(day) == shown,
        };
        let mut days = trail.days.iter().copied();
        let earlier = days.clone().rev().find(|day| Some(*day) < shown);
        Self {
            shown,
            is_past: shown < newest,
            earlier: earlier.map(day),
            later: days.find(|day| Some(*day) > shown).map(day),
            all: trail.days.iter().rev().copied().map(day).collect(),
        }
    }
}
