//! Navigation between the evaluation days of a board.

use super::address::Address;
use faceoff_api::views::board::BoardView;
use faceoff_service::views::board_timeline::BoardTimeline;
use jiff::civil::Date;

/// The evaluation days of a board.
pub(super) struct Days {
    /// The day of the shown board, which counts the results up to this day; `None` before the first day.
    pub(super) shown: Option<Date>,
    /// Is the shown day not the latest?
    pub(super) shows_past_day: bool,
    pub(super) earlier: Option<Day>,
    pub(super) later: Option<Day>,
    /// Newest first.
    pub(super) all: Vec<Day>,
}

/// A day with the address of its board.
pub(super) struct Day {
    pub(super) day: Date,
    pub(super) address: String,
    pub(super) is_shown: bool,
}

impl Days {
    pub(super) fn new(board: &BoardView, timeline: &BoardTimeline, address: &Address) -> Self {
        let newest = timeline.days.last().copied();
        let shown = board.day.or(newest);
        // The address of the latest day has no date, so that an open page moves on to the next day.
        let day = |day: Date| Day {
            day,
            address: address.with_day((Some(day) != newest).then_some(day)),
            is_shown: Some(day) == shown,
        };
        let mut days = timeline.days.iter().copied();
        let earlier = days.clone().rev().find(|day| Some(*day) < shown);
        Self {
            shown,
            shows_past_day: shown < newest,
            earlier: earlier.map(day),
            later: days.find(|day| Some(*day) > shown).map(day),
            all: timeline.days.iter().rev().copied().map(day).collect(),
        }
    }
}
