use super::{
    progress::Meetings,
    round::{Matchday, Pairing},
};
use faceoff_types::TeamName;

/// Everybody meets everybody once, by the circle method: all but one team stand in a circle that turns by
/// one place a matchday, and those who face each other play. With an odd number the empty place faces
/// one team a day, which has a bye; each team has exactly one.
///
/// At home is who was so less often against the same opponent; at the first meeting it follows from the
/// places, so that no team is at home more than once more, or once less, than away.
pub(super) fn round_robin<'a>(teams: &[&'a TeamName], meetings: &Meetings<'a>) -> Vec<Matchday> {
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
            // Who turns up at the place that does not turn: the last team, or nobody.
            if circle < count {
                matchday
                    .pairings
                    .push(pairing(teams, [day, circle], meetings));
            } else {
                matchday.byes.push(teams[day].clone());
            }
            for step in 1..=(circle - 1) / 2 {
                let places = [(day + step) % circle, (day + circle - step) % circle];
                matchday.pairings.push(pairing(teams, places, meetings));
            }
            matchday
        })
        .collect()
}

fn pairing<'a>(teams: &[&'a TeamName], places: [usize; 2], meetings: &Meetings<'a>) -> Pairing {
    let [a, b] = places.map(|place| teams[place]);
    let first_is_home = match meetings.home_lead(a, b) {
        0 => is_home_at_first(places, teams.len()),
        lead => lead < 0,
    };
    let [home, away] = if first_is_home { [a, b] } else { [b, a] };
    Pairing {
        home: home.clone(),
        away: away.clone(),
    }
}

/// All places in one circle: each is at home against the next half of it. With an even number the
/// place right across belongs to neither half; there the lower number is at home.
fn is_home_at_first([a, b]: [usize; 2], count: usize) -> bool {
    let ahead = (b + count - a) % count;
    if 2 * ahead == count {
        a < b
    } else {
        2 * ahead < count
    }
}
