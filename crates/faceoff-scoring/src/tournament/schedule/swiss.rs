//! Swiss tournaments: in each round, teams with similar results play each other, without repeats if possible.

use super::{
    matching::most_pairs,
    progress::{PairingCounts, Progress},
    round::{Matchday, Pairing, Round},
};
use crate::{
    random_numbers::RandomNumbers,
    tournament::{bye::Bye, standings::score_tournament_with},
};
use faceoff_types::TeamName;
use std::collections::BTreeMap;

/// One pairing of a Swiss tournament.
///
/// Teams are sorted by the standings; in the first round the order is random. Each team without an opponent is paired with
/// the next one that it has not met, unless that would force an avoidable repeat further down. With an odd number of
/// teams, the lowest of those with the fewest byes has a bye.
pub(super) fn swiss(progress: &Progress<'_>, random_numbers: &mut RandomNumbers) -> Matchday {
    let mut teams = ranked_teams(progress, random_numbers);
    let mut matchday = Matchday::default();
    if !teams.len().is_multiple_of(2) {
        let bye = teams.remove(next_bye(&teams, progress.rounds));
        matchday.byes.push(bye.clone());
    }
    let pairing_counts = progress.pairing_counts();
    for [upper, lower] in pairs(&teams, &pairing_counts) {
        let [a, b] = [teams[upper], teams[lower]];
        matchday
            .pairings
            .push(pairing([a, b], &pairing_counts, random_numbers));
    }
    matchday
}

/// The byes of a Swiss tournament, which give points.
pub(super) fn byes(rounds: &[Round]) -> Vec<Bye> {
    let byes_of_round = |round: &Round| {
        let number = round.number;
        let byes = round.byes().map(move |team| Bye {
            round: number,
            team: team.clone(),
        });
        byes.collect::<Vec<_>>()
    };
    rounds.iter().flat_map(byes_of_round).collect()
}

/// The active teams, best first; teams without a game or a bye are last, in random order.
fn ranked_teams<'a>(
    progress: &Progress<'a>,
    random_numbers: &mut RandomNumbers,
) -> Vec<&'a TeamName> {
    let mut teams: Vec<&TeamName> = progress.active_teams().collect();
    random_numbers.shuffle(&mut teams);
    let byes = byes(progress.rounds);
    let standings = score_tournament_with(progress.games, progress.departures, &byes).standings;
    let ranks: BTreeMap<&TeamName, u32> =
        standings.iter().map(|row| (&row.team, row.rank)).collect();
    teams.sort_by_key(|team| ranks.get(team).copied().unwrap_or(u32::MAX));
    teams
}

/// Index of the team with the next bye.
fn next_bye(teams: &[&TeamName], rounds: &[Round]) -> usize {
    let bye_count = |team: &TeamName| {
        let byes = rounds.iter().flat_map(Round::byes);
        byes.filter(|other| *other == team).count()
    };
    let counts: Vec<usize> = teams.iter().map(|team| bye_count(team)).collect();
    let fewest = counts.iter().min().copied().unwrap_or(0);
    counts
        .iter()
        .rposition(|count| *count == fewest)
        .unwrap_or(0)
}

/// The pairs of the round, as indices into `teams`. The number of teams is even.
fn pairs<'a>(teams: &[&'a TeamName], pairing_counts: &PairingCounts<'a>) -> Vec<[usize; 2]> {
    let count = teams.len();
    let games: Vec<u32> = teams
        .iter()
        .flat_map(|a| teams.iter().map(|b| pairing_counts.games(a, b)))
        .collect();
    let have_not_met = |a: usize, b: usize| games[count * a + b] == 0;
    let mut remaining: Vec<usize> = (0..count).collect();
    // Maximum number of pairs of remaining teams that have not met. Each choice below keeps this maximum reachable for the rest.
    let mut new_pairs = most_pairs(&remaining, have_not_met);
    let mut pairs = Vec::new();
    while let Some((upper, others)) = remaining.split_first() {
        let upper = *upper;
        let without = |opponent: usize| -> Vec<usize> {
            let rest = others.iter().copied();
            rest.filter(|other| *other != opponent).collect()
        };
        let opponent = others
            .iter()
            .copied()
            .filter(|other| have_not_met(upper, *other))
            .find(|other| most_pairs(&without(*other), have_not_met) + 1 == new_pairs);
        // A repeat is unavoidable and falls to this team: it gets the opponent that it met least often.
        let opponent = opponent.or_else(|| {
            new_pairs += 1; // this pair has met, so the subtraction below must not count it
            let mut repeats: Vec<usize> = others.to_vec();
            repeats.sort_by_key(|other| games[count * upper + other]);
            repeats
                .into_iter()
                .find(|other| most_pairs(&without(*other), have_not_met) + 1 == new_pairs)
        });
        let opponent = opponent.expect("the number of teams outside a maximum matching is even");
        new_pairs -= 1;
        remaining = without(opponent);
        pairs.push([upper, opponent]);
    }
    pairs
}

/// The home team is the one with fewer home games, then with fewer home games against this opponent, then a random one.
fn pairing<'a>(
    [a, b]: [&'a TeamName; 2],
    pairing_counts: &PairingCounts<'a>,
    random_numbers: &mut RandomNumbers,
) -> Pairing {
    let balance = pairing_counts.home_balance(a) - pairing_counts.home_balance(b);
    // Positive if `a` had more home games.
    let lead = if balance == 0 {
        pairing_counts.home_lead(a, b)
    } else {
        balance
    };
    // Drawn in all cases, so that later draws do not depend on this one.
    let is_heads = random_numbers.below(2) == 0;
    let [home, away] = if lead < 0 || (lead == 0 && is_heads) {
        [a, b]
    } else {
        [b, a]
    };
    Pairing {
        home: home.clone(),
        away: away.clone(),
    }
}
