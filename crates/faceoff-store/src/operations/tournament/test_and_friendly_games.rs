//! Games that do not count: test games of a team against the baseline (a submission of the organisers), and friendly games
//! of two teams.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        job_purpose,
        tournament::{current_entrants::current_entrants, game_lifecycle, rounds},
    },
    store::Store,
    tables::{
        friendly_games_declined,
        games::{self, Game, GamePurpose, GameState},
        season,
        submissions::{self, Submission},
        teams,
        tournaments::{self, Tournament},
    },
    write::Tx,
};
use faceoff_types::{GameId, GameSeedLabel, SubmissionId, TeamId, TournamentId};
use jiff::{Timestamp, tz::TimeZone};

/// The tournament, if test and friendly games of these teams are possible now.
async fn find_between_rounds(
    tx: &mut Tx,
    id: TournamentId,
    teams: &[TeamId],
) -> Result<Tournament> {
    season::check_open(tx).await?;
    let tournament = tournaments::find_open(tx, id).await?;
    let entrants = current_entrants(tx, id).await?;
    for team in teams {
        if !entrants.iter().any(|entrant| entrant.team == *team) {
            let team = teams::find(tx, *team).await?;
            return StoreError::conflict(format!(
                "{} is not in the tournament: ask an organiser to add it",
                team.name
            ));
        }
        teams::check_may_compete(tx, *team).await?;
    }
    if !games::pending_of_rounds(tx, id).await?.is_empty() {
        return StoreError::conflict(
            "a round is under way; test and friendly games are possible before and between rounds: try again when it is over",
        );
    }
    Ok(tournament)
}

/// A team's active submission, if the tournament accepts it.
async fn active_submission(
    tx: &mut Tx,
    tournament: &Tournament,
    team: TeamId,
) -> Result<SubmissionId> {
    let active: Option<Submission> =
        submissions::active(tx)
            .await?
            .into_iter()
            .find(|submission| {
                submission.team == team && rounds::accepts_runtime(tournament, submission)
            });
    match active {
        Some(submission) => Ok(submission.id),
        None => {
            let team = teams::find(tx, team).await?;
            StoreError::conflict(format!(
                "{} has no active, valid submission that the tournament accepts: upload one, or activate another",
                team.name
            ))
        }
    }
}

/// Refuses a request beyond the team's daily quota.
async fn check_quota(tx: &mut Tx, tournament: &Tournament, team: TeamId) -> Result<()> {
    let today = start_of_utc_day(tx.now);
    let used = games::count_requested(tx, team, today).await?;
    let limit = tournament.settings.test_and_friendly_games_per_day;
    if used >= limit {
        return Err(StoreError::GameQuotaExceeded { limit, used });
    }
    Ok(())
}

fn start_of_utc_day(now: Timestamp) -> Timestamp {
    let date = now.to_zoned(TimeZone::UTC).date();
    date.to_zoned(TimeZone::UTC)
        .map_or(now, |midnight| midnight.timestamp())
}

impl Store {
    /// Queues a test game of a team's active submission against the baseline. `asked_by` is `None` for an organiser, who
    /// has no quota. [`StoreError::Conflict`] while a round is open, without a baseline or a valid submission, if the team
    /// is not in the tournament, or the tournament is closed; [`StoreError::GameQuotaExceeded`].
    #[boxed_future]
    pub async fn request_test_game(
        &self,
        actor: Actor,
        id: TournamentId,
        team: TeamId,
        asked_by: Option<TeamId>,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            let tournament = find_between_rounds(tx, id, &[team]).await?;
            let Some(baseline) = tournament.baseline else {
                return StoreError::conflict(
                    "the tournament has no baseline to test against: ask the organisers, or play a friendly game",
                );
            };
            if let Some(requesting_team) = asked_by {
                check_quota(tx, &tournament, requesting_team).await?;
            }
            let own_submission = active_submission(tx, &tournament, team).await?;
            let opponent = submissions::find(tx, baseline).await?;
            let id = GameId::new();
            let game = Game {
                id,
                tournament: tournament.id,
                purpose: GamePurpose::Test { asked_by },
                teams: [team, opponent.team],
                submissions: [own_submission, baseline],
                seed: GameSeedLabel::Standalone(id),
                created_at: now,
                state: GameState::Queued,
            };
            game_lifecycle::enqueue(tx, &game, job_purpose::TEST_OR_FRIENDLY_GAME).await?;
            tx.record(
                Subject::Game(id),
                Event::TestOrFriendlyGameQueued {
                    team,
                    opponent: None,
                },
            );
            Ok(game)
        })
        .await
    }

    /// Queues a friendly game between the active submissions of two teams; the requesting team is the home side. Errors
    /// as of [`request_test_game`](Self::request_test_game), and [`StoreError::Conflict`] if the opponent declines
    /// friendly games.
    #[boxed_future]
    pub async fn request_friendly_game(
        &self,
        actor: Actor,
        id: TournamentId,
        asked_by: TeamId,
        opponent: TeamId,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            if asked_by == opponent {
                return StoreError::conflict("opponent: a team cannot play itself");
            }
            let tournament = find_between_rounds(tx, id, &[asked_by, opponent]).await?;
            if friendly_games_declined::declines(tx, opponent).await? {
                let opponent = teams::find(tx, opponent).await?;
                return StoreError::conflict(format!(
                    "{} plays no friendly games: ask another team",
                    opponent.name
                ));
            }
            check_quota(tx, &tournament, asked_by).await?;
            let id = GameId::new();
            let game = Game {
                id,
                tournament: tournament.id,
                purpose: GamePurpose::Friendly { asked_by },
                teams: [asked_by, opponent],
                submissions: [
                    active_submission(tx, &tournament, asked_by).await?,
                    active_submission(tx, &tournament, opponent).await?,
                ],
                seed: GameSeedLabel::Standalone(id),
                created_at: now,
                state: GameState::Queued,
            };
            game_lifecycle::enqueue(tx, &game, job_purpose::TEST_OR_FRIENDLY_GAME).await?;
            let event = Event::TestOrFriendlyGameQueued {
                team: asked_by,
                opponent: Some(opponent),
            };
            tx.record(Subject::Game(id), event);
            Ok(game)
        })
        .await
    }

    /// Cancels a game that does not count and is not over.
    #[boxed_future]
    pub async fn cancel_game(
        &self,
        actor: Actor,
        id: GameId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            let game = games::find(tx, id).await?;
            if let GamePurpose::Round(_) = game.purpose {
                return StoreError::conflict(
                    "a game of a round cannot be cancelled: pause the tournament, void the game's result, or let a team leave",
                );
            }
            if !game.state.is_open() {
                return StoreError::conflict("the game is over already");
            }
            game_lifecycle::cancel(tx, &game, reason).await?;
            games::find(tx, id).await
        })
        .await
    }

    /// Sets whether a team declines friendly games that other teams request.
    #[boxed_future]
    pub async fn set_declines_friendly_games(
        &self,
        actor: Actor,
        team: TeamId,
        declines: bool,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            teams::find(tx, team).await?;
            if friendly_games_declined::declines(tx, team).await? != declines {
                friendly_games_declined::set(tx, team, declines).await?;
                tx.record(
                    Subject::Team(team),
                    Event::FriendlyGamesDeclined { declines },
                );
            }
            Ok(())
        })
        .await
    }

    /// Number of test and friendly games that a team has requested on the UTC day of `now`, in all tournaments and
    /// including cancelled ones.
    #[boxed_future]
    pub async fn requested_games_on_day(&self, team: TeamId, now: Timestamp) -> Result<u32> {
        let mut connection = self.database.read.acquire().await?;
        games::count_requested(&mut connection, team, start_of_utc_day(now)).await
    }
}
