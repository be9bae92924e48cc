//! How a board stands, in words: what its rows are made of, who sees them, and whether they may still change.

use super::figures::minute;
use faceoff_api::views::{board::BoardView, stage::PhaseView};
use faceoff_types::Standings;

/// How far a stage is.
pub(super) const fn phase(phase: PhaseView, is_signed_off: bool) -> &'static str {
    match phase {
        PhaseView::Upcoming => "upcoming",
        PhaseView::Open => "open",
        PhaseView::Closed if is_signed_off => "signed off",
        PhaseView::Closed => "closed, provisional",
    }
}

/// What a row is, as the table's caption says it.
pub(super) fn rows(board: &BoardView) -> String {
    let rows = by(board);
    match board.day {
        None => rows,
        Some(day) => format!("{rows}, of the days up to {day}"),
    }
}

fn by(board: &BoardView) -> String {
    match board.rows_by {
        Standings::Latest => "Each team's newest finished evaluation".to_owned(),
        Standings::Best => {
            "Of each team the finished evaluation that stands highest by this board's order; the best of several is partly luck".to_owned()
        }
        Standings::MeanOfLast(1) => "Each team's last day with a result".to_owned(),
        Standings::MeanOfLast(days) => format!(
            "Of each team the mean of its last {days} days with a result, or of as many as it has: success rates and \
             penalty points are those of a mean day, intervals are over all of these days' episodes"
        ),
        Standings::Final => "Each team's evaluation of the final day".to_owned(),
    }
}

/// What decides, where that is not what is shown.
pub(super) fn still_to_come(board: &BoardView) -> Option<&'static str> {
    (board.standings == Standings::Final && board.rows_by != Standings::Final).then_some(
        "Only the final day counts, which the organiser starts once after the close. What is shown until then is no standing.",
    )
}

/// Who sees a blind board; `None` of others.
pub(super) fn blind(board: &BoardView, is_hidden: bool) -> Option<&'static str> {
    match (board.blind, is_hidden) {
        (false, _) => None,
        (true, true) => Some(
            "This stage is blind: its scores, points, tiers and comparisons are hidden from everybody, its teams included, until the organiser opens it. Nobody knows when that is.",
        ),
        (true, false) => Some("This stage is blind: nobody but the organiser sees this board."),
    }
}

/// May the result still change?
pub(super) fn result(board: &BoardView) -> String {
    match &board.finalised {
        None => "The result is provisional: it may change until the organiser has signed it off."
            .to_owned(),
        Some(done) => format!(
            "The result was signed off on {} by {}: nothing of it changes any more.",
            minute(done.at),
            done.by
        ),
    }
}
