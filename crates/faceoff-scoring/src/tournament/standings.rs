use super::{
    bye::{Bye, POINTS_BYE},
    departures::Departures,
    game::{PlayedGame, ScoredGame},
    rules::{POINTS_DRAW, POINTS_LOSS, POINTS_WIN},
    side::Side,
};
use faceoff_types::{LeftAs, RoundNumber, TeamName};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// A team's place in the tournament.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
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
    /// Goals scored, without points for fouls; 10 of a game that the other side forfeited.
    pub goals_for: u64,
    /// Goals conceded, without points for fouls; 10 of a game that the team forfeited.
    pub goals_against: u64,
    /// Penalty points of all games that count.
    pub penalty_points: f64,
    /// Byes that gave points, of a Swiss tournament.
    #[serde(default, skip_serializing_if = "none")]
    pub byes: u32,
    /// How the team left the tournament, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<LeftAs>,
}

const fn none(byes: &u32) -> bool {
    *byes == 0
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

/// Two teams that met more than once in a round; the two games of a mirrored pair are one meeting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RepeatedPairing {
    /// The round.
    pub round: u32,
    /// The teams, by name.
    pub teams: [TeamName; 2],
    /// How often they met.
    pub games: u32,
}

/// [`score_tournament_with`] where nobody left and no bye gives points.
#[must_use]
pub fn score_tournament(games: &[PlayedGame]) -> Tournament {
    score_tournament_with(games, &Departures::default(), &[])
}

/// Scores a tournament: 3 points for a win, 1 for a draw.
///
/// Standings go by points, then goal difference, then goals scored, then lower penalty, then by the
/// team's name, so that no two places are left to chance; disqualified teams stand below all others, in
/// the same order. No games, no standings. A pairing that occurs
/// more than once in a round counts each time and is reported in
/// [`Tournament::repeated_pairings`]. Games that [`Departures`] take out count for neither side, but both
/// teams keep their rows. `byes` are those that give points.
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
    let mut teams = BTreeMap::<&TeamName, Standing>::new();
    fn row<'a, 'b>(
        teams: &'a mut BTreeMap<&'b TeamName, Standing>,
        team: &'b TeamName,
        rounds: u32,
    ) -> &'a mut Standing {
        teams
            .entry(team)
            .or_insert_with(|| Standing::new(team.clone(), rounds as usize))
    }
    for game in games {
        let counts = departures.taken_out_by(game).is_none();
        for (side, team) in Side::BOTH.into_iter().zip(game.teams()) {
            let standing = row(&mut teams, team, rounds);
            if counts {
                standing.add(game, side);
            }
        }
    }
    for bye in byes {
        let standing = row(&mut teams, &bye.team, rounds);
        if !departures.takes_out(&bye.team, bye.round.get()) {
            standing.add_bye(bye.round);
        }
    }
    for standing in teams.values_mut() {
        standing.left = departures.left_as(&standing.team);
    }
    // In the order of names; the stable sort keeps it where all else is equal.
    let mut standings: Vec<_> = teams.into_values().collect();
    standings.sort_by(|a, b| {
        let out = |standing: &Standing| standing.left == Some(LeftAs::Disqualified);
        out(a)
            .cmp(&out(b))
            .then_with(|| b.points.cmp(&a.points))
            .then_with(|| b.goal_difference().cmp(&a.goal_difference()))
            .then_with(|| b.goals_for.cmp(&a.goals_for))
            .then_with(|| a.penalty_points.total_cmp(&b.penalty_points))
    });
    for (rank, standing) in (1..).zip(&mut standings) {
        standing.rank = rank;
    }
    Tournament {
        games: games
            .iter()
            .map(|game| game.scored(departures.taken_out_by(game)))
            .collect(),
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
            byes: 0,
            left: None,
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
    let mut meetings = BTreeMap::<(u32, [&TeamName; 2]), u32>::new();
    let mut mirrored = BTreeSet::new();
    for game in games {
        let mut teams = game.teams();
        teams.sort();
        let meeting = (game.round(), teams);
        let is_second_half = game
            .pair()
            .is_some_and(|pair| !mirrored.insert((meeting, pair)));
        if !is_second_half {
            *meetings.entry(meeting).or_default() += 1;
        }
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
