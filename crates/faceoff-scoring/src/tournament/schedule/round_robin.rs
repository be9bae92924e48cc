//! Round robins, in which each team plays each other one.

use super::{
    progress::PairingCounts,
    round::{Matchday, Pairing},
};
use faceoff_types::TeamName;

/// A single round robin by the circle method: all teams but one are on a circle that turns by one position per matchday,
/// and teams at opposite positions play. With an odd number of teams one position is empty; the team opposite has a bye,
/// so that each team has exactly one.
///
/// The home team is the one with fewer home games against this opponent. In their first game it follows from the positions,
/// so that the numbers of home and away games of a team differ by at most one.
pub(super) fn round_robin<'a>(
    teams: &[&'a TeamName],
    pairing_counts: &PairingCounts<'a>,
) -> Vec<Matchday> {
    let count = teams.len();
    if count < 2 {
        return Vec::new();
    }
    let circle_positions = if count.is_multiple_of(2) {
        count - 1
    } else {
        count
    };
    (0..circle_positions)
        .map(|day| {
            let mut matchday = Matchday::default();
            // The position off the circle: the last team or, with an odd number of teams, empty.
            if circle_positions < count {
                matchday
                    .pairings
                    .push(pairing(teams, [day, circle_positions], pairing_counts));
            } else {
                matchday.byes.push(teams[day].clone());
            }
            for distance in 1..=(circle_positions - 1) / 2 {
                let positions = [
                    (day + distance) % circle_positions,
                    (day + circle_positions - distance) % circle_positions,
                ];
                matchday
                    .pairings
                    .push(pairing(teams, positions, pairing_counts));
            }
            matchday
        })
        .collect()
}

fn pairing<'a>(
    teams: &[&'a TeamName],
    positions: [usize; 2],
    pairing_counts: &PairingCounts<'a>,
) -> Pairing {
    let [a, b] = positions.map(|position| teams[position]);
    let first_is_home = match pairing_counts.home_lead(a, b) {
        0 => is_home_at_first(positions, teams.len()),
        lead => lead < 0,
    };
    let [home, away] = if first_is_home { [a, b] } else { [b, a] };
    Pairing {
        home: home.clone(),
        away: away.clone(),
    }
}

/// Is `a` the home team in its first game against `b`? Both are positions on a circle of all `count` teams. Each team has home
/// games against the half of the circle ahead of it. With an even number of teams the opposite position is in neither half;
/// there the lower number is the home team.
fn is_home_at_first([a, b]: [usize; 2], count: usize) -> bool {
    let ahead = (b + count - a) % count;
    if 2 * ahead == count {
        a < b
    } else {
        2 * ahead < count
    }
}
