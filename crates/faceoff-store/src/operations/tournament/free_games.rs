//! Games that do not count: tests against the baseline, and friendly games.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        purpose,
        tournament::{play, playing::playing, rounds},
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
use faceoff_types::{GameId, GameSeed, SubmissionId, TeamId, TournamentId};
use jiff::{Timestamp, tz::TimeZone};

fn conflict<T>(why: impl Into<String>) -> Result<T> {
    Err(StoreError::Conflict(why.into()))
}

/// The tournament, if games that do not count are played in it now.
async fn between_rounds(tx: &mut Tx, id: TournamentId, teams: &[TeamId]) -> Result<Tournament> {
    season::check_open(tx).await?;
    let tournament = tournaments::find_open(tx, id).await?;
    let playing = playing(tx, id).await?;
    for team in teams {
        if !playing.iter().any(|entrant| entrant.team == *team) {
            let team = teams::find(tx, *team).await?;
            return conflict(format!(
                "{} is not in the tournament: an organiser enters it",
                team.name
            ));
        }
        teams::check_may_play(tx, *team).await?;
    }
    if !games::owed(tx, id).await?.is_empty() {
        return conflict(
            "a round is under way, and games that do not count are played before and between rounds: ask again when it is over",
        );
    }
    Ok(tournament)
}

/// What a team has active, if it can play.
async fn ready(tx: &mut Tx, tournament: &Tournament, team: TeamId) -> Result<SubmissionId> {
    let active: Option<Submission> = submissions::active(tx)
        .await?
        .into_iter()
        .find(|submission| submission.team == team && rounds::takes(tournament, submission));
    match active {
        Some(submission) => Ok(submission.id),
        None => {
            let team = teams::find(tx, team).await?;
            conflict(format!(
                "{} has no active, valid submission that the tournament takes: upload one, or activate another",
                team.name
            ))
        }
    }
}

/// Refuses one more game than a team may ask for on a day.
async fn check_quota(tx: &mut Tx, tournament: &Tournament, team: TeamId) -> Result<()> {
    let today = day_begins(tx.now);
    let used = games::count_asked(tx, team, today).await?;
    let limit = tournament.settings.free_games_per_day;
    if used >= limit {
        return Err(StoreError::FreeGamesSpent { limit, used });
    }
    Ok(())
}

/// The beginning of the UTC day.
fn day_begins(now: Timestamp) -> Timestamp {
    let date = now.to_zoned(TimeZone::UTC).date();
    date.to_zoned(TimeZone::UTC)
        .map_or(now, |midnight| midnight.timestamp())
}

impl Store {
    /// Queues a game of a team's active submission against the baseline. `asked_by` none: the organiser, without a quota.
    /// [`StoreError::Conflict`] while a round is under way, without baseline or a valid submission, if the team is not in
    /// the tournament, or that is closed; [`StoreError::FreeGamesSpent`].
    #[boxed]
    pub async fn order_test_game(
        &self,
        actor: Actor,
        id: TournamentId,
        team: TeamId,
        asked_by: Option<TeamId>,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            let tournament = between_rounds(tx, id, &[team]).await?;
            let Some(baseline) = tournament.baseline else {
                return conflict(
                    "the organisers have named no baseline to test against: ask them, or play a friendly game",
                );
            };
            if let Some(asking) = asked_by {
                check_quota(tx, &tournament, asking).await?;
            }
            let own = ready(tx, &tournament, team).await?;
            let against = submissions::find(tx, baseline).await?;
            let id = GameId::new();
            let game = Game {
                id,
                tournament: tournament.id,
                purpose: GamePurpose::Test { asked_by },
                teams: [team, against.team],
                submissions: [own, baseline],
                seed: GameSeed::Free(id),
                created_at: now,
                state: GameState::Queued,
            };
            play::enqueue(tx, &game, purpose::FREE_GAME).await?;
            tx.record(
                Subject::Game(id),
                Event::FreeGameQueued {
                    team,
                    opponent: None,
                },
            );
            Ok(game)
        })
        .await
    }

    /// Queues a game between what two teams have active; the asking one is at home. As
    /// [`order_test_game`](Self::order_test_game), and [`StoreError::Conflict`] if the opponent declines such games.
    #[boxed]
    pub async fn order_friendly_game(
        &self,
        actor: Actor,
        id: TournamentId,
        asked_by: TeamId,
        opponent: TeamId,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            if asked_by == opponent {
                return conflict("opponent: a team cannot play itself");
            }
            let tournament = between_rounds(tx, id, &[asked_by, opponent]).await?;
            if friendly_games_declined::has(tx, opponent).await? {
                let opponent = teams::find(tx, opponent).await?;
                return conflict(format!(
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
                    ready(tx, &tournament, asked_by).await?,
                    ready(tx, &tournament, opponent).await?,
                ],
                seed: GameSeed::Free(id),
                created_at: now,
                state: GameState::Queued,
            };
            play::enqueue(tx, &game, purpose::FREE_GAME).await?;
            let event = Event::FreeGameQueued {
                team: asked_by,
                opponent: Some(opponent),
            };
            tx.record(Subject::Game(id), event);
            Ok(game)
        })
        .await
    }

    /// Calls off a game that does not count and is not over.
    #[boxed]
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
                return conflict(
                    "a game of a round is not called off: pause the tournament, void its result, or let a team leave",
                );
            }
            if !game.state.is_open() {
                return conflict("the game is over already");
            }
            play::call_off(tx, &game, reason).await?;
            games::find(tx, id).await
        })
        .await
    }

    /// Does a team play no friendly games that others ask for?
    #[boxed]
    pub async fn set_declines_friendly_games(
        &self,
        actor: Actor,
        team: TeamId,
        declines: bool,
        now: Timestamp,
    ) -> Result<()> {
        self.write(actor, now, async |tx| {
            teams::find(tx, team).await?;
            if friendly_games_declined::has(tx, team).await? != declines {
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

    /// How many games that do not count a team has asked for on the UTC day of `now`, in all tournaments, those that
    /// were called off included.
    #[boxed]
    pub async fn free_games_used(&self, team: TeamId, now: Timestamp) -> Result<u32> {
        let mut connection = self.database.read.acquire().await?;
        games::count_asked(&mut connection, team, day_begins(now)).await
    }
}
