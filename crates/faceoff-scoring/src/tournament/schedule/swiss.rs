use super::{
    matching::most_pairs,
    progress::{Meetings, Progress},
    round::{Matchday, Pairing, Round},
};
use crate::{
    draws::Draws,
    tournament::{bye::Bye, standings::score_tournament_with},
};
use faceoff_types::TeamName;
use std::collections::BTreeMap;

/// One pairing of a Swiss tournament. In the order of the standings, which in the first round is drawn,
/// each team that has no opponent yet gets the next one that it has not met, unless that would force a
/// repeat further down that can be avoided. With an odd number the last one among those with the fewest
/// byes has a bye.
pub(super) fn swiss(progress: &Progress<'_>, draws: &mut Draws) -> Matchday {
    let mut order = in_order(progress, draws);
    let mut matchday = Matchday::default();
    if !order.len().is_multiple_of(2) {
        let bye = order.remove(next_bye(&order, progress.rounds));
        matchday.byes.push(bye.clone());
    }
    let meetings = progress.meetings();
    for [upper, lower] in pairs(&order, &meetings) {
        let [a, b] = [order[upper], order[lower]];
        matchday.pairings.push(pairing([a, b], &meetings, draws));
    }
    matchday
}

/// The byes of a Swiss tournament, which give points.
pub(super) fn byes(rounds: &[Round]) -> Vec<Bye> {
    let of = |round: &Round| {
        let number = round.number;
        let byes = round.byes().map(move |team| Bye {
            round: number,
            team: team.clone(),
        });
        byes.collect::<Vec<_>>()
    };
    rounds.iter().flat_map(of).collect()
}

/// Who is still in it, the best first; those without a game or a bye last, in a drawn order.
fn in_order<'a>(progress: &Progress<'a>, draws: &mut Draws) -> Vec<&'a TeamName> {
    let mut teams: Vec<&TeamName> = progress.playing().collect();
    draws.shuffle(&mut teams);
    let byes = byes(progress.rounds);
    let standings = score_tournament_with(progress.games, progress.departures, &byes).standings;
    let ranks: BTreeMap<&TeamName, u32> = standings
        .iter()
        .map(|standing| (&standing.team, standing.rank))
        .collect();
    teams.sort_by_key(|team| ranks.get(team).copied().unwrap_or(u32::MAX));
    teams
}

fn next_bye(order: &[&TeamName], rounds: &[Round]) -> usize {
    let had = |team: &TeamName| {
        let byes = rounds.iter().flat_map(Round::byes);
        byes.filter(|other| *other == team).count()
    };
    let counts: Vec<usize> = order.iter().map(|team| had(team)).collect();
    let fewest = counts.iter().min().copied().unwrap_or(0);
    counts
        .iter()
        .rposition(|count| *count == fewest)
        .unwrap_or(0)
}

/// Pairs of places in `order`, whose length is even.
fn pairs<'a>(order: &[&'a TeamName], meetings: &Meetings<'a>) -> Vec<[usize; 2]> {
    let count = order.len();
    let times: Vec<u32> = order
        .iter()
        .flat_map(|a| order.iter().map(|b| meetings.of(a, b)))
        .collect();
    let have_not_met = |a: usize, b: usize| times[count * a + b] == 0;
    let mut left: Vec<usize> = (0..order.len()).collect();
    // How many pairs of those left can be new ones.
    let mut new = most_pairs(&left, have_not_met);
    let mut pairs = Vec::new();
    while let Some((upper, others)) = left.split_first() {
        let upper = *upper;
        let without = |opponent: usize| -> Vec<usize> {
            let rest = others.iter().copied();
            rest.filter(|other| *other != opponent).collect()
        };
        let opponent = others
            .iter()
            .copied()
            .filter(|other| have_not_met(upper, *other))
            .find(|other| most_pairs(&without(*other), have_not_met) + 1 == new);
        // Somebody must meet an opponent again, and it is this team: the one that it met least often.
        let opponent = opponent.or_else(|| {
            new += 1; // this pair is none of the new ones
            let mut again: Vec<usize> = others.to_vec();
            again.sort_by_key(|other| times[count * upper + other]);
            again
                .into_iter()
                .find(|other| most_pairs(&without(*other), have_not_met) + 1 == new)
        });
        let opponent =
            opponent.expect("of an even number, those outside of a largest matching come in twos");
        new -= 1;
        left = without(opponent);
        pairs.push([upper, opponent]);
    }
    pairs
}

/// At home is who was so less often, then who was so less often against this opponent, then who is drawn.
fn pairing<'a>([a, b]: [&'a TeamName; 2], meetings: &Meetings<'a>, draws: &mut Draws) -> Pairing {
    let lead = meetings.home_balance(a) - meetings.home_balance(b);
    let lead = if lead == 0 {
        meetings.home_lead(a, b)
    } else {
        lead
    };
    // Drawn in any case, so that a draw does not depend on the others.
    let drawn = draws.below(2) == 0;
    let [home, away] = if lead < 0 || (lead == 0 && drawn) {
        [a, b]
    } else {
        [b, a]
    };
    Pairing {
        home: home.clone(),
        away: away.clone(),
    }
}
