use super::{
    game::{PlayedGame, ScoredGame},
    rules::{POINTS_DRAW, POINTS_LOSS, POINTS_WIN, Side},
};
use faceoff_types::TeamName;
use serde::Serialize;
use std::collections::BTreeMap;

/// A team's place in the tournament.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// From 1; no rank is given twice.
    pub rank: u32,
    /// The team.
    pub team: TeamName,
    /// Points of all rounds.
    pub points: u32,
    /// Points of each round from the first; 0 in a round that the team did not play.
    pub points_per_round: Vec<u32>,
    /// Games won.
    pub wins: u32,
    /// Games drawn.
    pub draws: u32,
    /// Games lost.
    pub losses: u32,
    /// Goals scored, without points for fouls.
    pub goals_for: u64,
    /// Goals conceded, without points for fouls.
    pub goals_against: u64,
    /// Penalty points of all games.
    pub penalty_points: f64,
}

/// A scored tournament: the games in the given order, the standings best first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tournament {
    /// The games.
    pub games: Vec<ScoredGame>,
    /// The standings.
    pub standings: Vec<Standing>,
    /// Games that the rules do not foresee; they count all the same.
    #[serde(skip)]
    pub repeated_pairings: Vec<RepeatedPairing>,
}

/// Two teams that met more than once in a round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RepeatedPairing {
    /// The round.
    pub round: u32,
    /// The teams, by name.
    pub teams: [TeamName; 2],
    /// How often they met.
    pub games: u32,
}

/// Scores a tournament: 3 points for a win, 1 for a draw.
///
/// Standings go by points, then goal difference, then goals scored, then lower penalty, then by the
/// team's name, so that no two places are left to chance. No games, no standings. A pairing that occurs
/// more than once in a round counts each time and is reported in
/// [`Tournament::repeated_pairings`].
#[must_use]
pub fn score_tournament(games: &[PlayedGame]) -> Tournament {
    let rounds = games.iter().map(PlayedGame::round).max().unwrap_or(0) as usize;
    let mut teams = BTreeMap::<&TeamName, Standing>::new();
    for game in games {
        let winner = game.winner();
        for (side, team) in [Side::Home, Side::Away].into_iter().zip(game.teams()) {
            teams
                .entry(team)
                .or_insert_with(|| Standing::new(team.clone(), rounds))
                .add(game, side, winner);
        }
    }
    // In the order of names; the stable sort keeps it where all else is equal.
    let mut standings: Vec<_> = teams.into_values().collect();
    standings.sort_by(|a, b| {
        b.points
            .cmp(&a.points)
            .then_with(|| b.goal_difference().cmp(&a.goal_difference()))
            .then_with(|| b.goals_for.cmp(&a.goals_for))
            .then_with(|| a.penalty_points.total_cmp(&b.penalty_points))
    });
    for (rank, standing) in (1..).zip(&mut standings) {
        standing.rank = rank;
    }
    Tournament {
        games: games.iter().map(PlayedGame::scored).collect(),
        standings,
        repeated_pairings: repeated_pairings(games),
    }
}

impl Standing {
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
        }
    }

    fn add(&mut self, game: &PlayedGame, side: Side, winner: Option<Side>) {
        let (own, other) = match side {
            Side::Home => (0, 1),
            Side::Away => (1, 0),
        };
        let (games, points) = match winner {
            None => (&mut self.draws, POINTS_DRAW),
            Some(winner) if winner == side => (&mut self.wins, POINTS_WIN),
            Some(_) => (&mut self.losses, POINTS_LOSS),
        };
        *games += 1;
        self.points += points;
        self.points_per_round[game.round() as usize - 1] += points;
        self.goals_for += u64::from(game.goals()[own]);
        self.goals_against += u64::from(game.goals()[other]);
        self.penalty_points += game.penalty_points()[own];
    }

    fn goal_difference(&self) -> i128 {
        i128::from(self.goals_for) - i128::from(self.goals_against)
    }
}

fn repeated_pairings(games: &[PlayedGame]) -> Vec<RepeatedPairing> {
    let mut meetings = BTreeMap::<(u32, [&TeamName; 2]), u32>::new();
    for game in games {
        let mut teams = game.teams();
        teams.sort();
        *meetings.entry((game.round(), teams)).or_default() += 1;
    }
    meetings
        .into_iter()
        .filter(|(_, games)| *games > 1)
        .map(|((round, teams), games)| RepeatedPairing {
            round,
            teams: teams.map(TeamName::clone),
            games,
        })
        .collect()
}
