//! Group stage of a tournament: the draw of the groups, their games and standings, and the finalists.

use super::{
    progress::{PairingCounts, Progress},
    round::{Matchday, Round},
    round_robin::round_robin,
};
use crate::{
    random_numbers::RandomNumbers,
    tournament::{
        departures::Departures,
        game::PlayedGame,
        standings::{StandingsRow, score_tournament_with},
    },
};
use faceoff_types::TeamName;

/// Draws groups whose sizes differ by at most one.
pub(super) fn draw_groups(
    teams: Vec<&TeamName>,
    groups: usize,
    random_numbers: &mut RandomNumbers,
) -> Vec<Vec<TeamName>> {
    let mut teams = teams;
    random_numbers.shuffle(&mut teams);
    let mut drawn = vec![Vec::new(); groups];
    for (index, team) in teams.into_iter().enumerate() {
        drawn[index % groups].push(team.clone());
    }
    drawn
}

/// A round robin in each group; matchday n of the round combines matchday n of all groups.
pub(super) fn group_matchdays(
    groups: &[Vec<TeamName>],
    pairing_counts: &PairingCounts<'_>,
) -> Vec<Matchday> {
    let mut matchdays = Vec::<Matchday>::new();
    for group in groups {
        let group: Vec<&TeamName> = group.iter().collect();
        for (day, mut matchday) in round_robin(&group, pairing_counts).into_iter().enumerate() {
            if matchdays.len() == day {
                matchdays.push(Matchday::default());
            }
            matchdays[day].pairings.append(&mut matchday.pairings);
            matchdays[day].byes.append(&mut matchday.byes);
        }
    }
    matchdays
}

/// The standings of a group, from the games between its members.
pub(super) fn group_standings(
    group: &[TeamName],
    round: &Round,
    games: &[PlayedGame],
    departures: &Departures,
) -> Vec<StandingsRow> {
    let group_games: Vec<PlayedGame> = games
        .iter()
        .filter(|game| {
            game.round() == round.number.get()
                && game.teams().into_iter().all(|team| group.contains(team))
        })
        .cloned()
        .collect();
    score_tournament_with(&group_games, departures, &[]).standings
}

/// The best `advance` active teams of each group, in the order of the groups. A team without a row in the standings, since
/// all others of its group left, is the last of its group.
pub(super) fn finalists(progress: &Progress<'_>, round: &Round, advance: usize) -> Vec<TeamName> {
    let mut finalists = Vec::new();
    for group in &round.groups {
        let standings = group_standings(group, round, progress.games, progress.departures);
        let ranked = standings.into_iter().map(|row| row.team);
        let mut ranking: Vec<TeamName> = ranked.collect();
        for team in group {
            if !ranking.contains(team) {
                ranking.push(team.clone());
            }
        }
        let active = ranking
            .into_iter()
            .filter(|team| !progress.departures.contains(team));
        finalists.extend(active.take(advance));
    }
    finalists
}
