//! Tournaments as text.

use super::format;
use faceoff_api::views::tournament::{TournamentPhase, TournamentSummary};
use faceoff_replay::model::CONTROL_STEP_S;
use faceoff_types::{DepartureKind, RoundNumber, TournamentFormat, TournamentRules};

pub(super) fn phase_label(summary: &TournamentSummary) -> String {
    let phase = match summary.phase {
        TournamentPhase::Open => "open, no round started yet",
        TournamentPhase::RoundRunning => "round in progress",
        TournamentPhase::BetweenRounds => "between rounds",
        TournamentPhase::AllRoundsPlayed => "all rounds played",
        TournamentPhase::Closed => "closed",
    };
    match (&summary.paused, summary.phase) {
        (Some(_), state) if state != TournamentPhase::Closed => format!("{phase}, paused"),
        _ => phase.to_owned(),
    }
}

pub(super) const fn departure_label(kind: DepartureKind) -> &'static str {
    match kind {
        DepartureKind::Withdrawn => "withdrawn",
        DepartureKind::Disqualified => "disqualified",
    }
}

/// The format of the tournament in one or two sentences.
pub(super) fn describe_format(rules: &TournamentRules) -> String {
    let format = match rules.format {
        TournamentFormat::RoundRobin { rounds } if rounds == RoundNumber::FIRST => {
            "One round in which each team plays every other team".to_owned()
        }
        TournamentFormat::RoundRobin { rounds } => {
            format!("{rounds} rounds; in each round every team plays every other team")
        }
        TournamentFormat::Groups { groups, advance } => format!(
            "{groups} groups drawn at random, in which each team plays every other team, then a final round of the first {advance} of each group"
        ),
        TournamentFormat::Swiss { rounds } => {
            format!("{rounds} rounds by the Swiss system: opponents have about the same points")
        }
    };
    let mirrored = if rules.mirrored {
        "; each pairing plays two games with the same seed and swapped sides"
    } else {
        ""
    };
    let minutes = format::one_decimal(f64::from(rules.steps) * CONTROL_STEP_S / 60.0);
    format!(
        "{format}{mirrored}. A game lasts {minutes} min ({} control steps), with the perturbations of the profile “{}”.",
        group_digits(rules.steps),
        rules.profile
    )
}

/// Digits in groups of three.
pub(super) fn group_digits(number: u32) -> String {
    match (number / 1_000_000, number / 1000 % 1000, number % 1000) {
        (0, ..10, _) => number.to_string(),
        (0, thousands, rest) => format!("{thousands},{rest:03}"),
        (millions, thousands, rest) => format!("{millions},{thousands:03},{rest:03}"),
    }
}

/// Do the pairings of a round depend on results of earlier rounds?
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
    fn digits_are_grouped_by_three() {
        let grouped = [600, 9999, 45_000, 1_234_567].map(group_digits);
        assert_eq!(grouped, ["600", "9999", "45,000", "1,234,567"]);
    }

    #[test]
    fn final_and_swiss_rounds_depend_on_results() {
        let rules = |format| TournamentRules {
            format,
            ..faceoff_airhockey::competition().tournament_rules()
        };
        let groups = rules(TournamentFormat::Groups {
            groups: 2,
            advance: 1,
        });
        assert!(!is_drawn_from_results(&groups, RoundNumber::FIRST));
        assert!(is_drawn_from_results(&groups, RoundNumber::SECOND));
        assert!(!is_drawn_from_results(
            &faceoff_airhockey::competition().tournament_rules(),
            RoundNumber::SECOND
        ));
    }
}
