//! The state of a tournament, built from database rows: entrants, rounds with their draw (who plays whom), games and results. Draws
//! and results are in the types of `faceoff-scoring`; the command `faceoff score tournament` reads the same types from a file.

use crate::{
    app::AppState, boxed_future, problem::Problem, viewer::Viewer,
    views::visibility::GameVisibility,
};
use faceoff_scoring::tournament::{
    Departure, Departures, GameScore, PlayedGame,
    schedule::{Entrants, Matchday, Pairing, Progress, Round, Schedule as _, ScheduleError, Table},
};
use faceoff_store::{
    Entrant, Game, GamePurpose, GameState, Tournament, TournamentRecord, TournamentRound,
};
use faceoff_types::{RoundNumber, Seed, TeamId, TeamName, TournamentId};
use std::collections::BTreeMap;

/// Pair numbers reserved for each round: more than a round has pairings, so the numbers of two rounds differ.
const PAIR_NUMBERS_PER_ROUND: u32 = 100_000;

/// The complete state of a tournament, with draws and results in the scoring's types.
#[derive(Debug)]
pub struct TournamentState {
    /// Rules and settings.
    pub tournament: Tournament,
    /// All entrants, including those that left.
    pub entrants: Vec<Entrant>,
    /// The started rounds, in order.
    pub rounds: Vec<TournamentRound>,
    /// The games of all rounds, in the order in which they are played.
    pub games: Vec<Game>,
    /// Teams that left, and from which round on.
    pub departures: Departures,
    names: BTreeMap<TeamId, TeamName>,
    /// The started rounds with their draw; empty in a state without standings.
    drawn: Vec<Round>,
    /// The results of all rounds; empty in a state without standings.
    played: Vec<PlayedGame>,
}

impl TournamentState {
    /// The state with draws and results.
    #[boxed_future]
    pub async fn find(app: &AppState, id: TournamentId) -> Result<Self, Problem> {
        Self::without_standings(app, id).await?.with_standings()
    }

    /// Adds the draws and results.
    pub(super) fn with_standings(mut self) -> Result<Self, Problem> {
        self.drawn = self.drawn_rounds()?;
        self.played = self.results(&self.games)?;
        Ok(self)
    }

    /// The state without draws and results: enough for single games, but not for tables.
    #[boxed_future]
    pub async fn without_standings(app: &AppState, id: TournamentId) -> Result<Self, Problem> {
        let TournamentRecord {
            tournament,
            entrants,
            rounds,
            games,
        } = app.store.tournament_record(id).await?;
        let teams = app.store.teams().await?.into_iter();
        let departures = entrants.iter().filter_map(|entrant| {
            let departure = entrant.departure.as_ref()?;
            Some(Departure {
                team: entrant.name.clone(),
                kind: departure.kind,
                from_round: departure.from_round,
            })
        });
        Ok(Self {
            departures: Departures::new(departures).map_err(Problem::internal)?,
            names: teams.map(|team| (team.id, team.name)).collect(),
            drawn: Vec::new(),
            played: Vec::new(),
            tournament,
            entrants,
            rounds,
            games,
        })
    }

    /// What a viewer may see of the games of the tournament.
    pub fn visibility(&self, viewer: Viewer) -> GameVisibility<'_> {
        GameVisibility::new(viewer, &self.tournament, &self.rounds)
    }

    /// A team's current name.
    pub fn name(&self, team: TeamId) -> Result<TeamName, Problem> {
        let name = self.names.get(&team).cloned();
        name.ok_or_else(|| Problem::internal(format_args!("no team has the id {team}")))
    }

    /// The id of the entrant with this name.
    pub fn team(&self, name: &TeamName) -> Result<TeamId, Problem> {
        let entrant = self.entrants.iter().find(|entrant| entrant.name == *name);
        entrant
            .map(|entrant| entrant.team)
            .ok_or_else(|| Problem::internal(format_args!("{name} is not in the tournament")))
    }

    /// The results of all rounds, including those that no longer count because a team left.
    pub fn played(&self) -> &[PlayedGame] {
        &self.played
    }

    /// The scored result of a game; `None` without a result.
    pub fn result(&self, game: &Game) -> Result<Option<(GameScore, PlayedGame)>, Problem> {
        let GameState::Played(stored_result) = &game.state else {
            return Ok(None);
        };
        let damaged = |error: &dyn std::fmt::Display| {
            Problem::internal(format_args!("the score of game {}: {error}", game.id))
        };
        let score: GameScore = serde_json::from_value(stored_result.results.clone())
            .map_err(|error| damaged(&error))?;
        let [home, away] = game.teams;
        // A test or friendly game belongs to no round; it is scored like a game of the first round.
        let schedule_entry = game.purpose.schedule_entry();
        let round =
            schedule_entry.map_or(RoundNumber::FIRST, |schedule_entry| schedule_entry.round);
        let mut game_entry = score.game_entry(round, [self.name(home)?, self.name(away)?]);
        let labels = game.submissions.map(|id| id.to_string().parse());
        let [home_label, away_label] = labels;
        game_entry.submissions = Some([
            home_label.map_err(|error| damaged(&error))?,
            away_label.map_err(|error| damaged(&error))?,
        ]);
        // The two games of a mirrored pairing, with exchanged sides, have the same number.
        game_entry.pair = schedule_entry
            .filter(|_| self.tournament.rules.mirrored)
            .map(|schedule_entry| {
                schedule_entry.round.get() * PAIR_NUMBERS_PER_ROUND + schedule_entry.pairing
            });
        let played = PlayedGame::try_from(game_entry).map_err(|error| damaged(&error))?;
        Ok(Some((score, played)))
    }

    /// The results of all games that have one.
    pub fn results<'a>(
        &self,
        games: impl IntoIterator<Item = &'a Game>,
    ) -> Result<Vec<PlayedGame>, Problem> {
        let results = games.into_iter().map(|game| self.result(game));
        let played_games =
            results.filter_map(|result| Some(result.transpose()?.map(|(_, game)| game)));
        played_games.collect()
    }

    /// The team whose departure excludes a game from the standings, if there is one. The game may be of a round or of a
    /// repetition of the schedule, in which all games are played again.
    pub fn excluded_by(&self, game: &Game) -> Result<Option<TeamName>, Problem> {
        let Some(schedule_entry) = game.purpose.schedule_entry() else {
            return Ok(None);
        };
        for team in game.teams {
            let name = self.name(team)?;
            if self.departures.excludes(&name, schedule_entry.round.get()) {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }

    /// Whether the game has no result and can still get one that counts.
    pub(crate) fn needs_result(&self, game: &Game) -> bool {
        let round = match game.purpose {
            GamePurpose::Round(schedule_entry) => Some(schedule_entry.round),
            _ => None,
        };
        // A team that withdraws may play the round under way to its end.
        let has_left = |team: &TeamId| {
            let entrant = self.entrants.iter().find(|entrant| entrant.team == *team);
            let departure = entrant.and_then(|entrant| entrant.departure.as_ref());
            departure
                .is_some_and(|departure| round.is_none_or(|round| departure.from_round <= round))
        };
        !matches!(
            game.state,
            GameState::Played(_) | GameState::Cancelled { .. }
        ) && !game.teams.iter().any(has_left)
    }

    /// The tables after these results. The first one decides who is the champion.
    pub fn tables(&self, played: &[PlayedGame]) -> Vec<Table> {
        let Ok(entrants) = self.all_entrants() else {
            // With fewer than two teams there is no table.
            return Vec::new();
        };
        let format = &self.tournament.rules.format;
        format.tables(&self.progress(&entrants, played))
    }

    /// The draw of the next round; `None` after the last.
    pub(crate) fn next_round(&self, secret: &Seed) -> Result<Option<Round>, ScheduleError> {
        let entrants = self.all_entrants()?;
        let seed = secret.tournament(self.tournament.number);
        let format = &self.tournament.rules.format;
        format.next_round(&seed, &self.progress(&entrants, &self.played))
    }

    fn all_entrants(&self) -> Result<Entrants, ScheduleError> {
        Entrants::new(self.entrants.iter().map(|entrant| entrant.name.clone()))
    }

    fn progress<'a>(&'a self, entrants: &'a Entrants, games: &'a [PlayedGame]) -> Progress<'a> {
        Progress {
            entrants,
            departures: &self.departures,
            rounds: &self.drawn,
            games,
        }
    }

    fn drawn_rounds(&self) -> Result<Vec<Round>, Problem> {
        let names = |teams: &[TeamId]| -> Result<Vec<TeamName>, Problem> {
            teams.iter().map(|team| self.name(*team)).collect()
        };
        let rounds = self.rounds.iter().map(|round| {
            let mut matchdays = BTreeMap::<u32, Matchday>::new();
            for game in &self.games {
                let GamePurpose::Round(schedule_entry) = game.purpose else {
                    continue;
                };
                // The second game of a mirrored pair repeats the pairing with exchanged sides.
                if schedule_entry.round != round.number || schedule_entry.second_half {
                    continue;
                }
                let [home, away] = game.teams;
                let day = matchdays.entry(schedule_entry.matchday).or_default();
                day.pairings.push(Pairing {
                    home: self.name(home)?,
                    away: self.name(away)?,
                });
            }
            for bye in &round.byes {
                let day = matchdays.entry(bye.matchday).or_default();
                day.byes.push(self.name(bye.team)?);
            }
            let groups = round.groups.iter().map(|group| names(group));
            Ok(Round {
                number: round.number,
                groups: groups.collect::<Result<_, Problem>>()?,
                matchdays: matchdays.into_values().collect(),
            })
        });
        rounds.collect()
    }
}
