//! Queries of tournaments, in which submissions play games against each other in rounds.

use crate::{
    boxed_future,
    error::Result,
    store::Store,
    tables::{
        entrants::{self, Entrant},
        friendly_games_declined,
        game_attempts::{self, GameAttempt},
        games::{self, Game},
        rounds::{self, TournamentRound},
        tournaments::{self, Tournament},
    },
};
use faceoff_types::{GameId, Side, TeamId, TournamentId};

/// The games that a list contains, and their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GameFilter {
    /// Games of the rounds, in the order of play.
    Rounds,
    /// Test games and friendly games, the newest first; of one team or of all.
    TestAndFriendly(Option<TeamId>),
    /// Games of the schedule's replays, in order.
    ScheduleReplays,
}

/// A tournament with everything that its results depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct TournamentRecord {
    pub tournament: Tournament,
    /// Its teams, by name.
    pub entrants: Vec<Entrant>,
    /// Its rounds, in order.
    pub rounds: Vec<TournamentRound>,
    /// The games of its rounds, in the order of play.
    pub games: Vec<Game>,
}

impl Store {
    /// All tournaments, the oldest first.
    #[boxed_future]
    pub async fn tournaments(&self) -> Result<Vec<Tournament>> {
        tournaments::all(&mut *self.database.read.acquire().await?).await
    }

    #[boxed_future]
    pub async fn tournament(&self, id: TournamentId) -> Result<Tournament> {
        tournaments::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// A tournament with its teams, rounds and their games, read in one transaction.
    #[boxed_future]
    pub async fn tournament_record(&self, id: TournamentId) -> Result<TournamentRecord> {
        let mut tx = self.database.read.begin().await?;
        Ok(TournamentRecord {
            tournament: tournaments::find(&mut tx, id).await?,
            entrants: entrants::all(&mut tx, id).await?,
            rounds: rounds::all(&mut tx, id).await?,
            games: games::of_rounds(&mut tx, id).await?,
        })
    }

    #[boxed_future]
    pub async fn games(&self, id: TournamentId, filter: GameFilter) -> Result<Vec<Game>> {
        let mut connection = self.database.read.acquire().await?;
        match filter {
            GameFilter::Rounds => games::of_rounds(&mut connection, id).await,
            GameFilter::TestAndFriendly(team) => {
                games::test_and_friendly(&mut connection, id, team).await
            }
            GameFilter::ScheduleReplays => games::of_schedule_replays(&mut connection, id).await,
        }
    }

    #[boxed_future]
    pub async fn game(&self, id: GameId) -> Result<Game> {
        games::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// All attempts at a game, in order.
    #[boxed_future]
    pub async fn game_attempts(&self, id: GameId) -> Result<Vec<GameAttempt>> {
        game_attempts::all(&mut *self.database.read.acquire().await?, id).await
    }

    /// The tail of an agent's standard error in the attempt that counts; `None` if no attempt does.
    #[boxed_future]
    pub async fn game_log(&self, id: GameId, side: Side) -> Result<Option<String>> {
        game_attempts::log(&mut *self.database.read.acquire().await?, id, side).await
    }

    /// Does the team decline friendly games that other teams request?
    #[boxed_future]
    pub async fn declines_friendly_games(&self, team: TeamId) -> Result<bool> {
        friendly_games_declined::declines(&mut *self.database.read.acquire().await?, team).await
    }
}
