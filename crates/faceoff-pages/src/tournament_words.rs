//! Tournaments in words.

use super::figures;
use faceoff_api::views::tournament::{TournamentHead, TournamentPhase};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_types::{RoundNumber, TournamentFormat, TournamentRules};

pub(super) fn phase(head: &TournamentHead) -> String {
    let phase = match head.phase {
        TournamentPhase::Open => "open, no round was started",
        TournamentPhase::Round => "a round is under way",
        TournamentPhase::Between => "between rounds",
        TournamentPhase::Played => "all rounds are over",
        TournamentPhase::Closed => "closed",
    };
    match (&head.paused, head.phase) {
        (Some(_), phase_is) if phase_is != TournamentPhase::Closed => format!("{phase}, paused"),
        _ => phase.to_owned(),
    }
}

/// How it is played, in a sentence or two.
pub(super) fn format(rules: &TournamentRules) -> String {
    let format = match rules.format {
        TournamentFormat::RoundRobin { rounds } if rounds == RoundNumber::FIRST => {
            "One round, in which everybody meets everybody".to_owned()
        }
        TournamentFormat::RoundRobin { rounds } => {
            format!("{rounds} rounds, in each of which everybody meets everybody")
        }
        TournamentFormat::Groups { groups, advance } => format!(
            "{groups} drawn groups, in which everybody meets everybody, then a final round of the first {advance} of each"
        ),
        TournamentFormat::Swiss { rounds } => {
            format!(
                "{rounds} rounds by the Swiss system: everybody meets somebody of about the same points"
            )
        }
    };
    let mirrored = if rules.mirrored {
        "; each meeting is two games of one seed with sides swapped"
    } else {
        ""
    };
    let minutes = figures::one(f64::from(rules.steps) * CONTROL_STEP_S / 60.0);
    format!(
        "{format}{mirrored}. A game lasts {} control steps ({minutes} min), in the profile {}.",
        grouped(rules.steps),
        rules.profile
    )
}

/// Digits in groups of three.
pub(super) fn grouped(number: u32) -> String {
    match (number / 1_000_000, number / 1000 % 1000, number % 1000) {
        (0, ..10, _) => number.to_string(),
        (0, thousands, rest) => format!("{thousands},{rest:03}"),
        (millions, thousands, rest) => format!("{millions},{thousands:03},{rest:03}"),
    }
}

/// Does who plays in a round follow from results of the rounds before?
pub(super) fn is_drawn_from_results(rules: &TournamentRules, round: RoundNumber) -> bool {
    round > RoundNumber::FIRST
        && matches!(
            rules.format,
            TournamentFormat::Groups { .. } | TournamentFormat::Swiss { .. }
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_groups_of_three() {
        let read = [600, 9999, 45_000, 1_234_567].map(grouped);
        assert_eq!(read, ["600", "9999", "45,000", "1,234,567"]);
    }

    #[test]
    fn a_final_and_a_swiss_round_tell_of_what_was_before() {
        let rules = |format| TournamentRules {
            format,
            ..TournamentRules::default()
        };
        let groups = rules(TournamentFormat::Groups {
            groups: 2,
            advance: 1,
        });
        assert!(!is_drawn_from_results(&groups, RoundNumber::FIRST));
        assert!(is_drawn_from_results(&groups, RoundNumber::SECOND));
        assert!(!is_drawn_from_results(
            &TournamentRules::default(),
            RoundNumber::SECOND
        ));
    }
}
