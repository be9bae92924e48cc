//! The progress of a tournament: its rounds and results so far, with checks that they match.

use super::{
    entrants::Entrants,
    error::ScheduleError,
    round::{Pairing, Round},
};
use crate::tournament::{departures::Departures, game::PlayedGame};
use faceoff_types::{RoundNumber, TeamName};
use std::collections::{BTreeMap, BTreeSet};

/// The state of a tournament: entrants, departures, rounds and results.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// All teams that ever entered, including those that left.
    pub entrants: &'a Entrants,
    /// Teams that left.
    pub departures: &'a Departures,
    /// All rounds so far, in order.
    pub rounds: &'a [Round],
    /// All games with a result.
    pub games: &'a [PlayedGame],
}

impl<'a> Progress<'a> {
    /// The teams that have not left, sorted by name.
    pub(super) fn active_teams(&self) -> impl Iterator<Item = &'a TeamName> + use<'a> {
        let departures = self.departures;
        self.entrants
            .iter()
            .filter(move |team| !departures.contains(team))
    }

    /// The first round with an open game, otherwise the next one; a departure now excludes games from this round on.
    /// `None` if a tournament cannot have another round.
    #[must_use]
    pub fn current_round(&self) -> Option<RoundNumber> {
        let finished = self.finished_pairings();
        let unfinished = self
            .rounds
            .iter()
            .find(|round| self.open_pairings(round, &finished).next().is_some());
        match unfinished {
            Some(round) => Some(round.number),
            None => self.next_round_number(),
        }
    }

    /// For each game with a result its round and its two teams, sorted by name.
    fn finished_pairings(&self) -> BTreeSet<(u32, [&'a TeamName; 2])> {
        self.games
            .iter()
            .map(|game| (game.round(), sorted_by_name(game.teams())))
            .collect()
    }

    /// The games of a round without a result, except those of teams in `departures`. A team that has withdrawn but still plays the round is
    /// not in that list yet: the caller sees to it.
    fn open_pairings<'b>(
        &'b self,
        round: &'a Round,
        finished: &'b BTreeSet<(u32, [&'a TeamName; 2])>,
    ) -> impl Iterator<Item = &'a Pairing> + 'b {
        let number = round.number.get();
        round.pairings().filter(move |pairing| {
            let teams = pairing.teams();
            !finished.contains(&(number, sorted_by_name(teams)))
                && !teams.iter().any(|team| self.departures.contains(team))
        })
    }

    pub(super) fn next_round_number(&self) -> Option<RoundNumber> {
        let next = u32::try_from(self.rounds.len()).ok()?.checked_add(1)?;
        next.try_into().ok()
    }

    /// Checks that rounds, games and entrants match and that no game is open.
    pub(super) fn check(&self) -> Result<(), ScheduleError> {
        for team in self.departures.teams() {
            self.check_entrant(team, || "the list of departures".to_owned())?;
        }
        let mut scheduled = BTreeSet::new();
        for (expected, round) in (1..).zip(self.rounds) {
            if round.number.get() != expected {
                return Err(ScheduleError::OutOfOrder {
                    expected,
                    got: round.number,
                });
            }
            for pairing in round.pairings() {
                scheduled.insert((expected, sorted_by_name(pairing.teams())));
            }
            let paired_teams = round.pairings().flat_map(Pairing::teams);
            for team in paired_teams.chain(round.byes()) {
                self.check_entrant(team, || format!("round {expected}"))?;
            }
        }
        for game in self.games {
            let [home, away] = game.teams();
            for team in [home, away] {
                self.check_entrant(team, || format!("a game of round {}", game.round()))?;
            }
            if !scheduled.contains(&(game.round(), sorted_by_name([home, away]))) {
                return Err(ScheduleError::UnknownGame {
                    round: game.round(),
                    home: home.clone(),
                    away: away.clone(),
                });
            }
        }
        let finished = self.finished_pairings();
        for round in self.rounds {
            let mut open = self.open_pairings(round, &finished);
            if let Some(first) = open.next() {
                return Err(ScheduleError::Unfinished {
                    round: round.number,
                    home: first.home.clone(),
                    away: first.away.clone(),
                    open: 1 + open.count(),
                });
            }
        }
        Ok(())
    }

    fn check_entrant(
        &self,
        team: &TeamName,
        place: impl FnOnce() -> String,
    ) -> Result<(), ScheduleError> {
        if self.entrants.contains(team) {
            return Ok(());
        }
        Err(ScheduleError::UnknownTeam {
            team: team.clone(),
            place: place(),
        })
    }

    /// Counts for each ordered pair of teams how often the first was the home team.
    pub(super) fn pairing_counts(&self) -> PairingCounts<'a> {
        let mut home_games = BTreeMap::new();
        for pairing in self.rounds.iter().flat_map(Round::pairings) {
            *home_games.entry(pairing.teams()).or_default() += 1;
        }
        PairingCounts { home_games }
    }
}

/// Numbers of scheduled games between teams.
pub(super) struct PairingCounts<'a> {
    /// For each `[home, away]` the number of games.
    home_games: BTreeMap<[&'a TeamName; 2], u32>,
}

impl<'a> PairingCounts<'a> {
    fn home_games(&self, home: &'a TeamName, away: &'a TeamName) -> u32 {
        self.home_games.get(&[home, away]).copied().unwrap_or(0)
    }

    /// Number of games between two teams.
    pub(super) fn games(&self, a: &'a TeamName, b: &'a TeamName) -> u32 {
        self.home_games(a, b) + self.home_games(b, a)
    }

    /// Home games minus away games of the first team against the second.
    pub(super) fn home_lead(&self, a: &'a TeamName, b: &'a TeamName) -> i64 {
        i64::from(self.home_games(a, b)) - i64::from(self.home_games(b, a))
    }

    /// Home games minus away games of a team against all opponents.
    pub(super) fn home_balance(&self, team: &TeamName) -> i64 {
        self.home_games
            .iter()
            .map(|([home, away], games)| {
                i64::from(*games) * (i64::from(*home == team) - i64::from(*away == team))
            })
            .sum()
    }
}

fn sorted_by_name(mut teams: [&TeamName; 2]) -> [&TeamName; 2] {
    teams.sort();
    teams
}
