//! Status of boards and stages as text: which results count, who sees them, and whether they are final.

use super::format::utc_minute;
use faceoff_api::views::{
    board::{BoardRow, BoardView},
    stage::PhaseView,
};
use faceoff_types::CountingResult;

/// The phase of a stage in words. A closed stage is provisional until it is signed off.
pub(super) const fn phase_label(phase: PhaseView, is_signed_off: bool) -> &'static str {
    match phase {
        PhaseView::Upcoming => "upcoming",
        PhaseView::Open => "open",
        PhaseView::Closed if is_signed_off => "signed off",
        PhaseView::Closed => "closed, provisional",
    }
}

/// Which results the rows contain, for the caption of the table.
pub(super) fn rows_caption(board: &BoardView) -> String {
    let rule = counting_rule(board);
    match board.day {
        None => rule,
        Some(day) => format!("{rule}, up to {day}"),
    }
}

/// The rank of a row as text. Statistically tied teams share the rank of the first one, with `=`, as in `2=`.
pub(super) fn shared_rank(rows: &[BoardRow], row: &BoardRow) -> String {
    let tied = rows
        .iter()
        .filter(|other| other.rank_group == row.rank_group);
    let (count, first) = tied.fold((0, row.rank), |(count, first), other| {
        (count + 1, first.min(other.rank))
    });
    match count {
        0 | 1 => row.rank.to_string(),
        _ => format!("{first}="),
    }
}

fn counting_rule(board: &BoardView) -> String {
    match board.rows_by {
        CountingResult::Latest => "Each team's latest finished evaluation".to_owned(),
        CountingResult::Best => {
            "Each team's best finished evaluation; the best of several is partly luck".to_owned()
        }
        CountingResult::MeanOfLast(1) => "Each team's last day with a result".to_owned(),
        CountingResult::MeanOfLast(days) => format!(
            "Each team's mean over its last {days} days with a result, or over fewer if it has fewer; intervals cover the \
             episodes of all these days"
        ),
        CountingResult::Final => "Each team's evaluation of the final day".to_owned(),
    }
}

/// Notice that only the final day counts, while the rows still show results of other days.
pub(super) fn final_day_notice(board: &BoardView) -> Option<&'static str> {
    (board.standings == CountingResult::Final && board.rows_by != CountingResult::Final)
        .then_some("Only the final day counts. The organisers start it after the stage has closed.")
}

/// Who sees a blind board; `None` if the board is not blind.
pub(super) fn blind_notice(board: &BoardView, is_hidden: bool) -> Option<&'static str> {
    match (board.blind, is_hidden) {
        (false, _) => None,
        (true, true) if board.tier_bounds.is_none() => Some(
            "This stage is blind: scores, penalty points and comparisons are hidden from everyone, teams included, until the organisers reveal them. No date is set.",
        ),
        (true, true) => Some(
            "This stage is blind: scores, penalty points, tiers and comparisons are hidden from everyone, teams included, until the organisers reveal them. No date is set.",
        ),
        (true, false) => Some("This stage is blind: only organisers see this board."),
    }
}

pub(super) fn result_status(board: &BoardView) -> String {
    match &board.sign_off {
        None => {
            "The result is provisional: it may change until the organisers sign it off.".to_owned()
        }
        Some(sign_off) => format!(
            "The result was signed off on {} by {} and is final.",
            utc_minute(sign_off.at),
            sign_off.by
        ),
    }
}
