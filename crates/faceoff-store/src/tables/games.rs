//! The table of games of tournaments. The types of a game are in [`game`](super::game).

pub use super::game::{
    Game, GameCommit, GamePurpose, GameRecording, GameState, ScheduleEntry, StoredGameResult,
};
use crate::{
    column::{Instant, Json},
    error::{Result, StoreError},
};
use faceoff_types::{GameId, GameSeedLabel, RoundNumber, SubmissionId, TeamId, TournamentId};
use jiff::Timestamp;
use serde_json::Value;
use sqlx::{SqliteConnection, types::Text};
use uuid::Uuid;

struct GameRow {
    id: GameId,
    tournament: TournamentId,
    purpose: String,
    round: Option<u32>,
    matchday: Option<u32>,
    pairing: Option<u32>,
    second_half: Option<bool>,
    replay: Option<u32>,
    asked_by: Option<TeamId>,
    home_team: TeamId,
    away_team: TeamId,
    home_submission: SubmissionId,
    away_submission: SubmissionId,
    seed: GameSeedLabel,
    created_at: Instant,
    state: String,
    attempt: Option<u32>,
    ended_at: Option<Instant>,
    reason: Option<String>,
    begun_at: Option<Instant>,
    score: Option<Json<Value>>,
    recording: Option<String>,
    game_blake3: Option<String>,
    home_blake3: Option<String>,
    away_blake3: Option<String>,
}

impl GameRow {
    fn purpose(&self) -> Option<GamePurpose> {
        let asked_by = self.asked_by;
        let entry = || {
            Some(ScheduleEntry {
                round: RoundNumber::try_from(self.round?).ok()?,
                matchday: self.matchday?,
                pairing: self.pairing?,
                second_half: self.second_half?,
            })
        };
        Some(match self.purpose.as_str() {
            "round" => GamePurpose::Round(entry()?),
            "test" => GamePurpose::Test { asked_by },
            "friendly" => GamePurpose::Friendly {
                asked_by: asked_by?,
            },
            "replay" => GamePurpose::ScheduleReplay {
                replay: self.replay?,
                original: entry()?,
            },
            _ => return None,
        })
    }

    fn state(&mut self) -> Option<GameState> {
        let recording = match (
            self.recording.take(),
            self.game_blake3.take(),
            self.home_blake3.take(),
            self.away_blake3.take(),
        ) {
            (Some(key), Some(game_blake3), Some(home), Some(away)) => Some(GameRecording {
                key,
                game_blake3,
                side_blake3: [home, away],
            }),
            _ => None,
        };
        let ended_at = self.ended_at.map(|at| at.0);
        Some(match self.state.as_str() {
            "queued" => GameState::Queued,
            "running" => GameState::Running {
                attempt: self.attempt?,
                since: self.begun_at?.0,
            },
            "played" => GameState::Played(Box::new(StoredGameResult {
                attempt: self.attempt?,
                at: ended_at?,
                results: self.score.take()?.0,
                recording,
            })),
            state => {
                let (at, reason) = (ended_at?, self.reason.take()?);
                match state {
                    "broken" => GameState::PlatformFailed { at, reason },
                    "void" => GameState::Void { at, reason },
                    "cancelled" => GameState::Cancelled { at, reason },
                    _ => return None,
                }
            }
        })
    }
}

impl TryFrom<GameRow> for Game {
    type Error = StoreError;

    fn try_from(mut row: GameRow) -> Result<Self> {
        let damaged = |row: &GameRow, field| {
            StoreError::Damaged(format!("game {}: {field} {:?}", row.id, row.state))
        };
        let purpose = row.purpose().ok_or_else(|| damaged(&row, "purpose"))?;
        let state = row.state().ok_or_else(|| damaged(&row, "state"))?;
        Ok(Self {
            id: row.id,
            tournament: row.tournament,
            purpose,
            teams: [row.home_team, row.away_team],
            submissions: [row.home_submission, row.away_submission],
            seed: row.seed,
            created_at: row.created_at.0,
            state,
        })
    }
}

/// `SELECT` of games `g` with the attempt that runs or counts; the argument is the SQL after the tables.
macro_rules! select_games {
    ($tail:literal $(, $argument:expr)*) => {
        sqlx::query_as!(
            GameRow,
            r#"SELECT g.id, g.tournament_id AS tournament, g.purpose, g.round, g.matchday, g.pairing, g.second_half,
                      g.replay, g.asked_by, g.home_team_id AS home_team, g.away_team_id AS away_team,
                      g.home_submission_id AS home_submission, g.away_submission_id AS away_submission, g.seed,
                      g.created_at, g.state, g.attempt, g.ended_at, g.reason, a.begun_at AS "begun_at?",
                      a.score AS "score?", a.recording AS "recording?", a.game_blake3 AS "game_blake3?",
                      a.home_blake3 AS "home_blake3?", a.away_blake3 AS "away_blake3?"
               FROM games g LEFT JOIN game_attempts a ON a.game_id = g.id AND a.number = g.attempt "# + $tail
            $(, $argument)*
        )
    };
}

fn parse_all(rows: Vec<GameRow>) -> Result<Vec<Game>> {
    rows.into_iter().map(Game::try_from).collect()
}

pub(crate) async fn find(connection: &mut SqliteConnection, id: GameId) -> Result<Game> {
    select_games!("WHERE g.id = ?", id)
        .fetch_optional(connection)
        .await?
        .ok_or(StoreError::NotFound("game"))?
        .try_into()
}

/// The games of all rounds, in the order of play.
pub(crate) async fn of_rounds(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<Game>> {
    let rows = select_games!(
        "WHERE g.tournament_id = ? AND g.purpose = 'round' ORDER BY g.round, g.pairing, g.second_half",
        tournament
    );
    parse_all(rows.fetch_all(connection).await?)
}

/// A game of a round that has no result and can still get one, because neither team has left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PendingGame {
    pub game: GameId,
    pub round: RoundNumber,
}

/// The pending games of all rounds, in the order of play.
pub(crate) async fn pending_of_rounds(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<PendingGame>> {
    let rows = sqlx::query!(
        r#"SELECT g.id AS game, g.round AS "round!"
           FROM games g
           JOIN entrants home ON home.tournament_id = g.tournament_id AND home.team_id = g.home_team_id
           JOIN entrants away ON away.tournament_id = g.tournament_id AND away.team_id = g.away_team_id
           WHERE g.tournament_id = ? AND g.purpose = 'round' AND g.state NOT IN ('played', 'cancelled')
             AND (home.left_as IS NULL OR home.from_round > g.round)
             AND (away.left_as IS NULL OR away.from_round > g.round)
           ORDER BY g.round, g.pairing, g.second_half"#,
        tournament
    );
    let pending = rows.fetch_all(connection).await?.into_iter().map(|row| {
        let round = RoundNumber::try_from(row.round)
            .map_err(|error| StoreError::Damaged(format!("game {}: {error}", row.game)))?;
        Ok(PendingGame {
            game: row.game,
            round,
        })
    });
    pending.collect()
}

/// The games of all replays of the schedule, in order.
pub(crate) async fn of_schedule_replays(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<Game>> {
    let rows = select_games!(
        "WHERE g.tournament_id = ? AND g.purpose = 'replay'
         ORDER BY g.replay, g.round, g.pairing, g.second_half",
        tournament
    );
    parse_all(rows.fetch_all(connection).await?)
}

/// Test games and friendly games, the newest first; of one team or of all teams.
pub(crate) async fn test_and_friendly(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
    team: Option<TeamId>,
) -> Result<Vec<Game>> {
    let rows = select_games!(
        "WHERE g.tournament_id = ?1 AND g.purpose IN ('test', 'friendly')
           AND (?2 IS NULL OR g.home_team_id = ?2 OR g.away_team_id = ?2)
         ORDER BY g.game_no DESC",
        tournament,
        team
    );
    parse_all(rows.fetch_all(connection).await?)
}

/// All queued and running games of a tournament.
pub(crate) async fn unfinished(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<Vec<Game>> {
    let rows = select_games!(
        "WHERE g.tournament_id = ? AND g.state IN ('queued', 'running') ORDER BY g.game_no",
        tournament
    );
    parse_all(rows.fetch_all(connection).await?)
}

/// The game that a job plays.
pub(crate) async fn of_job(connection: &mut SqliteConnection, job: Uuid) -> Result<Option<GameId>> {
    let found = sqlx::query_scalar!("SELECT id FROM games WHERE job_id = ?", Text(job))
        .fetch_optional(connection)
        .await?;
    Ok(found)
}

/// The job that plays a game, or played it last.
pub(crate) async fn job_of(connection: &mut SqliteConnection, id: GameId) -> Result<Uuid> {
    let found = sqlx::query_scalar!("SELECT job_id AS job FROM games WHERE id = ?", id)
        .fetch_optional(connection)
        .await?;
    found
        .flatten()
        .map(|job| job.0)
        .ok_or(StoreError::NotFound("game"))
}

/// Adds a game with the job that plays it.
pub(crate) async fn insert(
    connection: &mut SqliteConnection,
    game: &Game,
    job: Uuid,
) -> Result<()> {
    let (id, tournament, purpose) = (game.id, game.tournament, game.purpose.stored_name());
    let (round, matchday, pairing, second_half) = match game.purpose.schedule_entry() {
        None => (None, None, None, None),
        Some(entry) => (
            Some(entry.round.get()),
            Some(entry.matchday),
            Some(entry.pairing),
            Some(entry.second_half),
        ),
    };
    let (replay, asked_by) = match game.purpose {
        GamePurpose::Round(_) => (None, None),
        GamePurpose::Test { asked_by } => (None, asked_by),
        GamePurpose::Friendly { asked_by } => (None, Some(asked_by)),
        GamePurpose::ScheduleReplay { replay, .. } => (Some(replay), None),
    };
    let [home, away] = game.teams;
    let [home_submission, away_submission] = game.submissions;
    sqlx::query!(
        "INSERT INTO games (id, tournament_id, purpose, round, matchday, pairing, second_half, replay, asked_by,
                            home_team_id, away_team_id, home_submission_id, away_submission_id, seed, created_at,
                            job_id, state)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'queued')",
        id,
        tournament,
        purpose,
        round,
        matchday,
        pairing,
        second_half,
        replay,
        asked_by,
        home,
        away,
        home_submission,
        away_submission,
        game.seed,
        Instant(game.created_at),
        Text(job),
    )
    .execute(connection)
    .await?;
    Ok(())
}

/// Number of test games and friendly games that a team has requested since an instant. Cancelled ones are included,
/// because each one is a row and a job.
pub(crate) async fn count_requested(
    connection: &mut SqliteConnection,
    team: TeamId,
    since: Timestamp,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM games
           WHERE asked_by = ? AND created_at >= ?"#,
        team,
        Instant(since),
    )
    .fetch_one(connection)
    .await?)
}

/// Number of the newest replay of the schedule; 0 if there is none.
pub(crate) async fn last_replay(
    connection: &mut SqliteConnection,
    tournament: TournamentId,
) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COALESCE(MAX(replay), 0) AS "last!: u32" FROM games WHERE tournament_id = ?"#,
        tournament
    )
    .fetch_one(connection)
    .await?)
}

/// Number of queued and running games of all tournaments.
pub(crate) async fn count_open(connection: &mut SqliteConnection) -> Result<u32> {
    Ok(sqlx::query_scalar!(
        r#"SELECT COUNT(*) AS "count!: u32" FROM games WHERE state IN ('queued', 'running')"#
    )
    .fetch_one(connection)
    .await?)
}

/// Is the submission still needed by a tournament that is not closed: for a round, an open game, or as the baseline?
pub(crate) async fn needs_submission(
    connection: &mut SqliteConnection,
    submission: SubmissionId,
) -> Result<bool> {
    Ok(sqlx::query_scalar!(
        r#"SELECT EXISTS (SELECT 1 FROM round_submissions r JOIN tournaments t ON t.id = r.tournament_id
                          WHERE r.submission_id = ?1 AND t.closed_at IS NULL)
               OR EXISTS (SELECT 1 FROM games WHERE home_submission_id = ?1 AND state IN ('queued', 'running'))
               OR EXISTS (SELECT 1 FROM games WHERE away_submission_id = ?1 AND state IN ('queued', 'running'))
               OR EXISTS (SELECT 1 FROM tournaments WHERE baseline_id = ?1 AND closed_at IS NULL)
               AS "needs!: bool""#,
        submission
    )
    .fetch_one(connection)
    .await?)
}
