use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{purpose, tournament::play},
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
    /// A result counts no more; its attempt stays. The next round waits until the game is played again.
    /// [`StoreError::Conflict`] unless it is a round's game with a result.
    #[boxed]
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
                return Err(StoreError::Conflict(
                    "only a game of a round that has a result is voided: one that is queued or running is waited for".into(),
                ));
            };
            game_attempts::set_voided(tx, id, played.attempt, reason).await?;
            game_transitions::set_without_result(tx, id, NoResult::Void, reason, now).await?;
            let reason = reason.to_owned();
            tx.record(Subject::Game(id), Event::GameVoided { reason });
            games::find(tx, id).await
        })
        .await
    }

    /// Queues a game again that was voided or broken by us: same submissions, same seed. [`StoreError::Conflict`] of any
    /// other, and if one of its teams had left by its round.
    #[boxed]
    pub async fn rerun_game(&self, actor: Actor, id: GameId, now: Timestamp) -> Result<Game> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let game = games::find(tx, id).await?;
            tournaments::find_open(tx, game.tournament).await?;
            if !matches!(
                game.state,
                GameState::Void { .. } | GameState::Broken { .. }
            ) {
                return Err(StoreError::Conflict(
                    "only a game that was voided, or that we could not play, is played again: void its result first"
                        .into(),
                ));
            }
            let lane = match game.purpose {
                GamePurpose::Round(meeting) => {
                    let has_left = |entrant: &Entrant| {
                        let left = entrant.left.as_ref();
                        game.teams.contains(&entrant.team)
                            && left.is_some_and(|left| left.from_round <= meeting.round)
                    };
                    if entrants::all(tx, game.tournament).await?.iter().any(has_left) {
                        return Err(StoreError::Conflict(
                            "one of its teams has left the tournament by its round: it counts for nobody".into(),
                        ));
                    }
                    purpose::ROUND_GAME
                }
                GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => {
                    return Err(StoreError::Conflict(
                        "a game that does not count is not played again: ask for another one".into(),
                    ));
                }
                GamePurpose::Replay { .. } => purpose::REPLAY_GAME,
            };
            play::enqueue_again(tx, &game, lane).await?;
            tx.record(Subject::Game(id), Event::GameQueuedAgain);
            games::find(tx, id).await
        })
        .await
    }
}
