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
    let circle = if count.is_multiple_of(2) {
        count - 1
    } else {
        count
    };
    (0..circle)
        .map(|day| {
            let mut matchday = Matchday::default();
            // The position off the circle: the last team or, with an odd number of teams, empty.
            if circle < count {
                matchday
                    .pairings
                    .push(pairing(teams, [day, circle], pairing_counts));
            } else {
                matchday.byes.push(teams[day].clone());
            }
            for step in 1..=(circle - 1) / 2 {
                let positions = [(day + step) % circle, (day + circle - step) % circle];
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

/// With all positions on one circle, each has home games against the next half of the circle. With an even number the
/// opposite position is in neither half; there the lower number is the home team.
fn is_home_at_first([a, b]: [usize; 2], count: usize) -> bool {
    let ahead = (b + count - a) % count;
    if 2 * ahead == count {
        a < b
    } else {
        2 * ahead < count
    }
}
