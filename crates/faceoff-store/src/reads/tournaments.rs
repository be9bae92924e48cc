use crate::{
    boxed,
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

/// Which games of a tournament.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GamesOf {
    /// Those of its rounds, in the order of play.
    Rounds,
    /// Those that do not count, the newest first; of a team or of all.
    Free(Option<TeamId>),
    /// Those of the schedule played again, in order.
    Replays,
}

/// A tournament with all that counts, as it was at one moment.
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
    /// All tournaments, the first one first.
    #[boxed]
    pub async fn tournaments(&self) -> Result<Vec<Tournament>> {
        tournaments::all(&mut *self.database.read.acquire().await?).await
    }

    #[boxed]
    pub async fn tournament(&self, id: TournamentId) -> Result<Tournament> {
        tournaments::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// One with its teams, rounds and their games, all of one moment.
    #[boxed]
    pub async fn tournament_record(&self, id: TournamentId) -> Result<TournamentRecord> {
        let mut tx = self.database.read.begin().await?;
        Ok(TournamentRecord {
            tournament: tournaments::find(&mut tx, id).await?,
            entrants: entrants::all(&mut tx, id).await?,
            rounds: rounds::all(&mut tx, id).await?,
            games: games::of_rounds(&mut tx, id).await?,
        })
    }

    #[boxed]
    pub async fn games(&self, id: TournamentId, of: GamesOf) -> Result<Vec<Game>> {
        let mut connection = self.database.read.acquire().await?;
        match of {
            GamesOf::Rounds => games::of_rounds(&mut connection, id).await,
            GamesOf::Free(team) => games::free(&mut connection, id, team).await,
            GamesOf::Replays => games::of_replays(&mut connection, id).await,
        }
    }

    #[boxed]
    pub async fn game(&self, id: GameId) -> Result<Game> {
        games::find(&mut *self.database.read.acquire().await?, id).await
    }

    /// Every time that a slot began it, in order.
    #[boxed]
    pub async fn game_attempts(&self, id: GameId) -> Result<Vec<GameAttempt>> {
        game_attempts::all(&mut *self.database.read.acquire().await?, id).await
    }

    /// The end of an agent's standard error in the attempt that counts; none without one.
    #[boxed]
    pub async fn game_log(&self, id: GameId, side: Side) -> Result<Option<String>> {
        game_attempts::log(&mut *self.database.read.acquire().await?, id, side).await
    }

    /// Does a team play no friendly games that others ask for?
    #[boxed]
    pub async fn declines_friendly_games(&self, team: TeamId) -> Result<bool> {
        friendly_games_declined::has(&mut *self.database.read.acquire().await?, team).await
    }
}
