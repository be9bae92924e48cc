use super::{
    entrants::Entrants,
    error::ScheduleError,
    round::{Pairing, Round},
};
use crate::tournament::{departures::Departures, game::PlayedGame};
use faceoff_types::{RoundNumber, TeamName};
use std::collections::{BTreeMap, BTreeSet};

/// What has happened in a tournament so far.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Everybody that has been in it.
    pub entrants: &'a Entrants,
    /// Who left.
    pub departures: &'a Departures,
    /// All rounds that were drawn, in order.
    pub rounds: &'a [Round],
    /// All results.
    pub games: &'a [PlayedGame],
}

impl<'a> Progress<'a> {
    /// The teams that are still in it, by name.
    pub(super) fn playing(&self) -> impl Iterator<Item = &'a TeamName> + use<'a> {
        let departures = self.departures;
        self.entrants
            .iter()
            .filter(move |team| !departures.contains(team))
    }

    /// The round that a team leaves from that leaves now: the first one with an open game, else the one
    /// after all that were drawn. `None` if a tournament cannot have so many rounds.
    #[must_use]
    pub fn round_under_way(&self) -> Option<RoundNumber> {
        let played = self.played();
        let open = self
            .rounds
            .iter()
            .find(|round| self.open(round, &played).next().is_some());
        match open {
            Some(round) => Some(round.number),
            None => self.next_number(),
        }
    }

    /// Which pairs of teams, by name, have a result in which round.
    fn played(&self) -> BTreeSet<(u32, [&'a TeamName; 2])> {
        self.games
            .iter()
            .map(|game| (game.round(), by_name(game.teams())))
            .collect()
    }

    /// The games of a round that have no result and still can get one.
    fn open<'b>(
        &'b self,
        round: &'a Round,
        played: &'b BTreeSet<(u32, [&'a TeamName; 2])>,
    ) -> impl Iterator<Item = &'a Pairing> + 'b {
        let number = round.number.get();
        round.pairings().filter(move |pairing| {
            let teams = pairing.teams();
            !played.contains(&(number, by_name(teams)))
                && !teams.iter().any(|team| self.departures.contains(team))
        })
    }

    pub(super) fn next_number(&self) -> Option<RoundNumber> {
        let next = u32::try_from(self.rounds.len()).ok()?.checked_add(1)?;
        next.try_into().ok()
    }

    /// That rounds and games fit to each other and to the entrants, and that nothing is open.
    pub(super) fn check(&self) -> Result<(), ScheduleError> {
        for team in self.departures.teams() {
            self.known(team, || "said to have left".to_owned())?;
        }
        let mut drawn = BTreeSet::new();
        for (expected, round) in (1..).zip(self.rounds) {
            if round.number.get() != expected {
                return Err(ScheduleError::OutOfOrder {
                    expected,
                    got: round.number,
                });
            }
            for pairing in round.pairings() {
                drawn.insert((expected, by_name(pairing.teams())));
            }
            let paired = round.pairings().flat_map(Pairing::teams);
            for team in paired.chain(round.byes()) {
                self.known(team, || format!("in round {expected}"))?;
            }
        }
        for game in self.games {
            let [home, away] = game.teams();
            for team in [home, away] {
                self.known(team, || format!("in a game of round {}", game.round()))?;
            }
            if !drawn.contains(&(game.round(), by_name([home, away]))) {
                return Err(ScheduleError::UnknownGame {
                    round: game.round(),
                    home: home.clone(),
                    away: away.clone(),
                });
            }
        }
        let played = self.played();
        for round in self.rounds {
            let mut open = self.open(round, &played);
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

    fn known(&self, team: &TeamName, place: impl FnOnce() -> String) -> Result<(), ScheduleError> {
        if self.entrants.contains(team) {
            return Ok(());
        }
        Err(ScheduleError::UnknownTeam {
            team: team.clone(),
            place: place(),
        })
    }

    /// For each ordered pair of teams, how often the first was at home against the second.
    pub(super) fn meetings(&self) -> Meetings<'a> {
        let mut homes = BTreeMap::new();
        for pairing in self.rounds.iter().flat_map(Round::pairings) {
            *homes.entry(pairing.teams()).or_default() += 1;
        }
        Meetings { homes }
    }
}

/// How often teams were drawn against each other.
pub(super) struct Meetings<'a> {
    homes: BTreeMap<[&'a TeamName; 2], u32>,
}

impl<'a> Meetings<'a> {
    fn homes(&self, home: &'a TeamName, away: &'a TeamName) -> u32 {
        self.homes.get(&[home, away]).copied().unwrap_or(0)
    }

    /// How often two teams were drawn against each other.
    pub(super) fn of(&self, a: &'a TeamName, b: &'a TeamName) -> u32 {
        self.homes(a, b) + self.homes(b, a)
    }

    /// How much more often the first was at home against the second than away.
    pub(super) fn home_lead(&self, a: &'a TeamName, b: &'a TeamName) -> i64 {
        i64::from(self.homes(a, b)) - i64::from(self.homes(b, a))
    }

    /// How much more often a team was at home than away, against anybody.
    pub(super) fn home_balance(&self, team: &TeamName) -> i64 {
        self.homes
            .iter()
            .map(|([home, away], games)| {
                i64::from(*games) * (i64::from(*home == team) - i64::from(*away == team))
            })
            .sum()
    }
}

fn by_name(mut teams: [&TeamName; 2]) -> [&TeamName; 2] {
    teams.sort();
    teams
}
