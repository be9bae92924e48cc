//! Decisions on games: an organiser voids a result, or lets a game be played again.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{job_purpose, tournament::game_lifecycle},
    store::Store,
    tables::{
        entrants::{self, Entrant},
        game_attempts,
        game_transitions::{self, NoResult},
        games::{self, Game, GamePurpose, GameState},
        season, tournaments,
    },
};
use faceoff_types::GameId;
use jiff::Timestamp;

impl Store {
    /// Voids the result of a game; its attempt stays. The next round cannot start until the game is rerun.
    /// [`StoreError::Conflict`] unless it is a round's game with a result.
    #[boxed_future]
    pub async fn void_game(
        &self,
        actor: Actor,
        id: GameId,
        reason: &str,
        now: Timestamp,
    ) -> Result<Game> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let game = games::find(tx, id).await?;
            tournaments::find_open(tx, game.tournament).await?;
            let (GamePurpose::Round(_), GameState::Played(played)) = (game.purpose, &game.state)
            else {
                return StoreError::conflict(
                    "only a game of a round with a result can be voided: wait for the end of one that is queued or running",
                );
            };
            game_attempts::set_voided(tx, id, played.attempt, reason).await?;
            game_transitions::set_without_result(tx, id, NoResult::Void, reason, now).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Game(id), Event::GameVoided { reason });
            games::find(tx, id).await
        })
        .await
    }

    /// Reruns a game that was voided or ended by a platform fault, with the same submissions and seed.
    /// [`StoreError::Conflict`] for any other game, and if one of its teams had left by its round.
    #[boxed_future]
    pub async fn rerun_game(&self, actor: Actor, id: GameId, now: Timestamp) -> Result<Game> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let game = games::find(tx, id).await?;
            tournaments::find_open(tx, game.tournament).await?;
            if !matches!(
                game.state,
                GameState::Void { .. } | GameState::PlatformFailed { .. }
            ) {
                return StoreError::conflict(
                    "only a game that was voided, or that ended by a platform fault, can be rerun: void its result first",
                );
            }
            let job = match game.purpose {
                GamePurpose::Round(schedule_entry) => {
                    let has_left = |entrant: &Entrant| {
                        let departure = entrant.departure.as_ref();
                        game.teams.contains(&entrant.team)
                            && departure.is_some_and(|departure| departure.from_round <= schedule_entry.round)
                    };
                    if entrants::all(tx, game.tournament).await?.iter().any(has_left) {
                        return StoreError::conflict(
                            "one of its teams has left the tournament by its round, so the game does not count",
                        );
                    }
                    job_purpose::ROUND_GAME
                }
                GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => {
                    return StoreError::conflict(
                        "a game that does not count cannot be rerun: request another one",
                    );
                }
                GamePurpose::ScheduleReplay { .. } => job_purpose::SCHEDULE_REPLAY_GAME,
            };
            game_lifecycle::enqueue_again(tx, &game, job).await?;
            tx.record(Subject::Game(id), Event::GameQueuedAgain);
            games::find(tx, id).await
        })
        .await
    }
}
