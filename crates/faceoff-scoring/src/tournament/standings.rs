//! The standings of a tournament: the table of teams by their points, goals and penalty points.

use super::{
    bye::{Bye, POINTS_BYE},
    departures::Departures,
    game::{PlayedGame, ScoredGame},
    rules::{POINTS_DRAW, POINTS_LOSS, POINTS_WIN},
    side::Side,
};
use faceoff_types::{DepartureKind, RoundNumber, TeamName};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The row of a team in a table of standings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct StandingsRow {
    /// From 1; ranks are unique.
    pub rank: u32,
    /// Name of the team.
    pub team: TeamName,
    /// Total points of all rounds.
    pub points: u32,
    /// Points of each round from the first; 0 for a round without the team.
    pub points_per_round: Vec<u32>,
    /// Number of won games.
    pub wins: u32,
    /// Number of drawn games.
    pub draws: u32,
    /// Number of lost games.
    pub losses: u32,
    /// Goals scored, without points for fouls; for a game that the other side forfeited 10, or the goals of a larger lead.
    pub goals_for: u64,
    /// Goals conceded, without points for fouls; for a game that the team forfeited 10, or the goals of the opponent's larger lead.
    pub goals_against: u64,
    /// Total penalty points of the games that count.
    pub penalty_points: f64,
    /// Number of byes that gave points, in a Swiss tournament.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub byes: u32,
    /// How the team left the tournament; absent if it did not.
    #[serde(rename = "left", default, skip_serializing_if = "Option::is_none")]
    pub departure: Option<DepartureKind>,
}

const fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// A scored tournament.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tournament {
    /// All games with their results, in the given sequence.
    pub games: Vec<ScoredGame>,
    /// The table, best first.
    pub standings: Vec<StandingsRow>,
    /// Pairings with more games than the rules provide for; all their games count.
    #[serde(skip)]
    pub repeated_pairings: Vec<RepeatedPairing>,
}

/// Two teams that met more than once in a round; the two games of a mirrored pair count as one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RepeatedPairing {
    /// Number of the round, from 1.
    pub round: u32,
    /// The teams, sorted by name.
    pub teams: [TeamName; 2],
    /// Number of games, with a mirrored pair as one.
    pub games: u32,
}

/// [`score_tournament_with`] without departures and without byes that give points.
#[must_use]
pub fn score_tournament(games: &[PlayedGame]) -> Tournament {
    score_tournament_with(games, &Departures::default(), &[])
}

/// Scores a tournament: 3 points for a win, 1 for a draw.
///
/// Standings are sorted by points, goal difference, goals scored, lower penalty, and team name, so that ranks are
/// unique. Disqualified teams are below all others, sorted likewise. Without games the standings are empty.
///
/// A pairing that occurs more than once in a round counts each time and is reported in
/// [`Tournament::repeated_pairings`]. Games that [`Departures`] exclude count for neither side, but both teams keep
/// their rows. `byes` are those that give points.
#[must_use]
pub fn score_tournament_with(
    games: &[PlayedGame],
    departures: &Departures,
    byes: &[Bye],
) -> Tournament {
    let rounds = games
        .iter()
        .map(PlayedGame::round)
        .chain(byes.iter().map(|bye| bye.round.get()))
        .max()
        .unwrap_or(0);
    let mut teams = BTreeMap::<&TeamName, StandingsRow>::new();
    fn row<'a, 'b>(
        teams: &'a mut BTreeMap<&'b TeamName, StandingsRow>,
        team: &'b TeamName,
        rounds: u32,
    ) -> &'a mut StandingsRow {
        teams
            .entry(team)
            .or_insert_with(|| StandingsRow::new(team.clone(), rounds as usize))
    }
    for game in games {
        let is_counted = departures.excluded_by(game).is_none();
        for (side, team) in Side::BOTH.into_iter().zip(game.teams()) {
            let row = row(&mut teams, team, rounds);
            if is_counted {
                row.add(game, side);
            }
        }
    }
    for bye in byes {
        let row = row(&mut teams, &bye.team, rounds);
        if !departures.excludes(&bye.team, bye.round.get()) {
            row.add_bye(bye.round);
        }
    }
    for row in teams.values_mut() {
        row.departure = departures.kind(&row.team);
    }
    // The rows are sorted by name; the sort is stable, so ties stay sorted by name.
    let mut standings: Vec<_> = teams.into_values().collect();
    standings.sort_by(|a, b| {
        let is_disqualified =
            |row: &StandingsRow| row.departure == Some(DepartureKind::Disqualified);
        is_disqualified(a)
            .cmp(&is_disqualified(b))
            .then_with(|| b.points.cmp(&a.points))
            .then_with(|| b.goal_difference().cmp(&a.goal_difference()))
            .then_with(|| b.goals_for.cmp(&a.goals_for))
            .then_with(|| a.penalty_points.total_cmp(&b.penalty_points))
    });
    for (rank, row) in (1..).zip(&mut standings) {
        row.rank = rank;
    }
    Tournament {
        games: games
            .iter()
            .map(|game| game.scored(departures.excluded_by(game)))
            .collect(),
        standings,
        repeated_pairings: repeated_pairings(games),
    }
}

impl StandingsRow {
    fn new(team: TeamName, rounds: usize) -> Self {
        Self {
            rank: 0,
            team,
            points: 0,
            points_per_round: vec![0; rounds],
            wins: 0,
            draws: 0,
            losses: 0,
            goals_for: 0,
            goals_against: 0,
            penalty_points: 0.0,
            byes: 0,
            departure: None,
        }
    }

    fn add_bye(&mut self, round: RoundNumber) {
        self.byes += 1;
        self.points += POINTS_BYE;
        self.points_per_round[round.index()] += POINTS_BYE;
    }

    fn add(&mut self, game: &PlayedGame, side: Side) {
        let (own, other) = (side as usize, side.other() as usize);
        let (games, points) = match game.winner() {
            None => (&mut self.draws, POINTS_DRAW),
            Some(winner) if winner == side => (&mut self.wins, POINTS_WIN),
            Some(_) => (&mut self.losses, POINTS_LOSS),
        };
        *games += 1;
        self.points += points;
        self.points_per_round[game.round() as usize - 1] += points;
        let goals = game.counted_goals();
        self.goals_for += u64::from(goals[own]);
        self.goals_against += u64::from(goals[other]);
        self.penalty_points += game.penalty_points()[own];
    }

    fn goal_difference(&self) -> i128 {
        i128::from(self.goals_for) - i128::from(self.goals_against)
    }
}

fn repeated_pairings(games: &[PlayedGame]) -> Vec<RepeatedPairing> {
    let mut counts = BTreeMap::<(u32, [&TeamName; 2]), u32>::new();
    let mut first_halves = BTreeSet::new();
    for game in games {
        let mut teams = game.teams();
        teams.sort();
        let pairing = (game.round(), teams);
        let is_second_half = game
            .pair()
            .is_some_and(|pair| !first_halves.insert((pairing, pair)));
        if !is_second_half {
            *counts.entry(pairing).or_default() += 1;
        }
    }
    counts
        .into_iter()
        .filter(|(_, games)| *games > 1)
        .map(|((round, teams), games)| RepeatedPairing {
            round,
            teams: teams.map(TeamName::clone),
            games,
        })
        .collect()
}
