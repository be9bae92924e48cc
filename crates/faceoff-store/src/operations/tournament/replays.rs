//! The schedule played again: how sure is its champion?

use crate::{
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{
        purpose,
        tournament::{
            play,
            playing::{owed, playing},
        },
    },
    store::Store,
    tables::{
        games::{self, Game, GamePurpose, GameState},
        rounds, season, tournaments,
    },
};
use faceoff_types::{GameId, GameSeed, TournamentId};
use jiff::Timestamp;

/// The most times that a schedule is played again.
pub const MAX_REPLAYS: u32 = 1000;

impl Store {
    /// Queues all games of all rounds `times` times more, with the same submissions and fresh seeds; they do not count and
    /// keep no recordings. Returns how many games. [`StoreError::Conflict`] if a round is to come or under way, or
    /// more than [`MAX_REPLAYS`] came of it.
    pub async fn order_replays(
        &self,
        actor: Actor,
        id: TournamentId,
        times: u32,
        now: Timestamp,
    ) -> Result<u32> {
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let tournament = tournaments::find_open(tx, id).await?;
            let playing = playing(tx, id).await?;
            let schedule = games::of_rounds(tx, id).await?;
            let (started, all) = (rounds::count(tx, id).await?, tournament.rules.format.last_round());
            if started < all.get() {
                return Err(StoreError::Conflict(format!(
                    "a schedule is played again when all of it was played: {started} of {all} rounds were started"
                )));
            }
            let owed = owed(&schedule, &playing).len();
            if owed > 0 {
                return Err(StoreError::Conflict(format!(
                    "a schedule is played again when all of it was played: {owed} games have no result yet"
                )));
            }
            let last = games::last_replay(tx, id).await?;
            if times == 0 || times > MAX_REPLAYS - last.min(MAX_REPLAYS) {
                return Err(StoreError::Conflict(format!(
                    "times: expected 1 to {}, {last} of {MAX_REPLAYS} were ordered before; got {times}",
                    MAX_REPLAYS.saturating_sub(last)
                )));
            }
            let mut count = 0;
            for replay in last + 1..=last + times {
                for played in &schedule {
                    let (GamePurpose::Round(of), GameState::Played(_)) =
                        (played.purpose, &played.state)
                    else {
                        continue;
                    };
                    let game = Game {
                        id: GameId::new(),
                        purpose: GamePurpose::Replay { replay, of },
                        seed: GameSeed::Replay {
                            tournament: tournament.number,
                            replay,
                            round: of.round,
                            meeting: of.meeting,
                        },
                        created_at: now,
                        state: GameState::Queued,
                        ..played.clone()
                    };
                    play::enqueue(tx, &game, purpose::REPLAY_GAME).await?;
                    count += 1;
                }
            }
            let event = Event::ReplaysOrdered {
                times,
                games: count,
            };
            tx.record(Subject::Tournament(id), event);
            Ok(count)
        })
        .await
    }

    /// Calls off the replays that are not over. Returns how many games.
    pub async fn cancel_replays(
        &self,
        actor: Actor,
        id: TournamentId,
        now: Timestamp,
    ) -> Result<u32> {
        self.write(actor, now, async |tx| {
            tournaments::find_open(tx, id).await?;
            let mut count = 0;
            for game in games::open(tx, id).await? {
                if let GamePurpose::Replay { .. } = game.purpose {
                    play::call_off(tx, &game, "the organisers called the replays off").await?;
                    count += 1;
                }
            }
            if count > 0 {
                tx.record(
                    Subject::Tournament(id),
                    Event::ReplaysCancelled { games: count },
                );
            }
            Ok(count)
        })
        .await
    }
}
