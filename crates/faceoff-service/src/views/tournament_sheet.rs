//! A tournament as the scoring reads it: what `faceoff score tournament` is given as a file is made here of rows.

use crate::{app::AppState, boxed, problem::Problem, viewer::Viewer, views::sight::GameSight};
use faceoff_scoring::tournament::{
    Departure, Departures, GameScore, PlayedGame,
    schedule::{Entrants, Matchday, Pairing, Progress, Round, Schedule as _, ScheduleError, Table},
};
use faceoff_store::{
    Entrant, Game, GamePurpose, GameState, Tournament, TournamentRecord, TournamentRound,
};
use faceoff_types::{RoundNumber, Seed, TeamId, TeamName, TournamentId};
use std::collections::BTreeMap;

/// Halves of different meetings must not have the same number; a round has fewer meetings.
const MOST_MEETINGS: u32 = 100_000;

/// What there is of a tournament, with what is drawn and played in the scoring's own types.
#[derive(Debug)]
pub struct TournamentSheet {
    /// Its rules and settings.
    pub tournament: Tournament,
    /// Who has entered, those that left included.
    pub entrants: Vec<Entrant>,
    /// Those that were drawn, the earlier first.
    pub rounds: Vec<TournamentRound>,
    /// Of rounds, in the order of play.
    pub games: Vec<Game>,
    /// Who has left, and from which round on.
    pub departures: Departures,
    names: BTreeMap<TeamId, TeamName>,
    drawn: Vec<Round>,
    played: Vec<PlayedGame>,
}

impl TournamentSheet {
    /// With all that was drawn and played.
    #[boxed]
    pub async fn find(app: &AppState, id: TournamentId) -> Result<Self, Problem> {
        let mut sheet = Self::unscored(app, id).await?;
        sheet.drawn = sheet.drawn_rounds()?;
        sheet.played = sheet.results(&sheet.games)?;
        Ok(sheet)
    }

    /// What is to be known of single games; it makes no tables.
    #[boxed]
    pub async fn unscored(app: &AppState, id: TournamentId) -> Result<Self, Problem> {
        let TournamentRecord {
            tournament,
            entrants,
            rounds,
            games,
        } = app.store.tournament_record(id).await?;
        let teams = app.store.teams().await?.into_iter();
        let left = entrants.iter().filter_map(|entrant| {
            let left = entrant.left.as_ref()?;
            Some(Departure {
                team: entrant.name.clone(),
                left_as: left.left_as,
                from_round: left.from_round,
            })
        });
        Ok(Self {
            departures: Departures::new(left).map_err(Problem::internal)?,
            names: teams.map(|team| (team.id, team.name)).collect(),
            drawn: Vec::new(),
            played: Vec::new(),
            tournament,
            entrants,
            rounds,
            games,
        })
    }

    /// What somebody sees of its games.
    pub fn sight(&self, viewer: Viewer) -> GameSight<'_> {
        GameSight::new(viewer, &self.tournament, &self.rounds)
    }

    /// As a team is called now.
    pub fn name(&self, team: TeamId) -> Result<TeamName, Problem> {
        let name = self.names.get(&team).cloned();
        name.ok_or_else(|| Problem::internal(format_args!("no team has the id {team}")))
    }

    /// Whose name it is.
    pub fn team(&self, name: &TeamName) -> Result<TeamId, Problem> {
        let found = self.entrants.iter().find(|entrant| entrant.name == *name);
        found
            .map(|entrant| entrant.team)
            .ok_or_else(|| Problem::internal(format_args!("{name} is not in the tournament")))
    }

    /// The results of all rounds that count, or did before a team left.
    pub fn played(&self) -> &[PlayedGame] {
        &self.played
    }

    /// What a game came to, by the rules; none without a result.
    pub fn result(&self, game: &Game) -> Result<Option<(GameScore, PlayedGame)>, Problem> {
        let GameState::Played(row) = &game.state else {
            return Ok(None);
        };
        let damaged = |error: &dyn std::fmt::Display| {
            Problem::internal(format_args!("the score of game {}: {error}", game.id))
        };
        let score: GameScore =
            serde_json::from_value(row.score.clone()).map_err(|error| damaged(&error))?;
        let [home, away] = game.teams;
        // What is of no round is told by its result alone.
        let meeting = game.purpose.meeting();
        let round = meeting.map_or(RoundNumber::FIRST, |meeting| meeting.round);
        let mut entry = score.entry(round, [self.name(home)?, self.name(away)?]);
        let labels = game.submissions.map(|id| id.to_string().parse());
        let [home, away] = labels;
        entry.submissions = Some([
            home.map_err(|error| damaged(&error))?,
            away.map_err(|error| damaged(&error))?,
        ]);
        entry.pair = meeting
            .filter(|_| self.tournament.rules.mirrored)
            .map(|meeting| meeting.round.get() * MOST_MEETINGS + meeting.meeting);
        let played = PlayedGame::try_from(entry).map_err(|error| damaged(&error))?;
        Ok(Some((score, played)))
    }

    /// The results of those games that have one.
    pub fn results<'a>(
        &self,
        games: impl IntoIterator<Item = &'a Game>,
    ) -> Result<Vec<PlayedGame>, Problem> {
        let results = games.into_iter().map(|game| self.result(game));
        let played = results.filter_map(|result| Some(result.transpose()?.map(|(_, game)| game)));
        played.collect()
    }

    /// Is a game of a round, or of the schedule played again, taken out since a side left?
    pub fn taken_out_by(&self, game: &Game) -> Result<Option<TeamName>, Problem> {
        let Some(meeting) = game.purpose.meeting() else {
            return Ok(None);
        };
        for team in game.teams {
            let name = self.name(team)?;
            if self.departures.takes_out(&name, meeting.round.get()) {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }

    /// Does the game have no result, and can it still get one that counts?
    pub(crate) fn is_awaited(&self, game: &Game) -> bool {
        let has_left = |team: &TeamId| {
            let of = self.entrants.iter().find(|entrant| entrant.team == *team);
            of.is_some_and(|entrant| entrant.left.is_some())
        };
        !matches!(
            game.state,
            GameState::Played(_) | GameState::Cancelled { .. }
        ) && !game.teams.iter().any(has_left)
    }

    /// The tables that these results make, the deciding one first: of the rounds as they were drawn.
    pub fn tables(&self, played: &[PlayedGame]) -> Vec<Table> {
        let Ok(entrants) = self.all_entrants() else {
            // Of fewer than two teams nothing was drawn.
            return Vec::new();
        };
        let format = &self.tournament.rules.format;
        format.tables(&self.progress(&entrants, played))
    }

    /// The round after all that were started; none after the last.
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
        let drawn = self.rounds.iter().map(|round| {
            let mut matchdays = BTreeMap::<u32, Matchday>::new();
            for game in &self.games {
                let GamePurpose::Round(meeting) = game.purpose else {
                    continue;
                };
                if meeting.round != round.number || meeting.second_half {
                    continue;
                }
                let [home, away] = game.teams;
                let day = matchdays.entry(meeting.matchday).or_default();
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
        drawn.collect()
    }
}
