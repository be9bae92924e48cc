use super::{
    progress::{Meetings, Progress},
    round::{Matchday, Round},
    round_robin::round_robin,
};
use crate::{
    draws::Draws,
    tournament::{
        departures::Departures,
        game::PlayedGame,
        standings::{Standing, score_tournament_with},
    },
};
use faceoff_types::TeamName;

/// Deals the teams into groups whose sizes differ by one at most, by a draw.
pub(super) fn draw_groups(
    teams: Vec<&TeamName>,
    groups: usize,
    draws: &mut Draws,
) -> Vec<Vec<TeamName>> {
    let mut teams = teams;
    draws.shuffle(&mut teams);
    let mut all = vec![Vec::new(); groups];
    for (place, team) in teams.into_iter().enumerate() {
        all[place % groups].push(team.clone());
    }
    all
}

/// A round robin in each group; the first matchdays of all groups are the round's first, and so on.
pub(super) fn group_matchdays(groups: &[Vec<TeamName>], meetings: &Meetings<'_>) -> Vec<Matchday> {
    let mut all = Vec::<Matchday>::new();
    for group in groups {
        let group: Vec<&TeamName> = group.iter().collect();
        for (day, mut matchday) in round_robin(&group, meetings).into_iter().enumerate() {
            if all.len() == day {
                all.push(Matchday::default());
            }
            all[day].pairings.append(&mut matchday.pairings);
            all[day].byes.append(&mut matchday.byes);
        }
    }
    all
}

/// The standings of a group: games among its members alone.
pub(super) fn group_standings(
    group: &[TeamName],
    round: &Round,
    games: &[PlayedGame],
    departures: &Departures,
) -> Vec<Standing> {
    let of_group: Vec<PlayedGame> = games
        .iter()
        .filter(|game| {
            game.round() == round.number.get()
                && game.teams().into_iter().all(|team| group.contains(team))
        })
        .cloned()
        .collect();
    score_tournament_with(&of_group, departures, &[]).standings
}

/// The best `advance` of each group that are still in the tournament, groups in order. A team that is
/// alone in its group, since the others left, has no standing and advances last.
pub(super) fn finalists(progress: &Progress<'_>, round: &Round, advance: usize) -> Vec<TeamName> {
    let mut all = Vec::new();
    for group in &round.groups {
        let standings = group_standings(group, round, progress.games, progress.departures);
        let ranked = standings.into_iter().map(|standing| standing.team);
        let mut order: Vec<TeamName> = ranked.collect();
        for team in group {
            if !order.contains(team) {
                order.push(team.clone());
            }
        }
        let playing = order
            .into_iter()
            .filter(|team| !progress.departures.contains(team));
        all.extend(playing.take(advance));
    }
    all
}
