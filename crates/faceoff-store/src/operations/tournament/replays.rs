//! The schedule played again: how sure is its champion?

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{purpose, tournament::play},
    store::Store,
    tables::{
        entrants,
        games::{self, Game, GamePurpose, GameState},
        rounds, season, tournaments,
    },
    write::Tx,
};
use faceoff_types::{GameId, GameSeed, RoundNumber, TeamId, TournamentId};
use jiff::Timestamp;
use std::collections::BTreeMap;

/// The most times that a schedule is played again.
pub const MAX_REPLAYS: u32 = 1000;

/// The most games that a tournament's replays have in all: they are queued at once, and read at once.
pub const MAX_REPLAYED_GAMES: u32 = 10_000;

/// The games that count: with a result, and of teams that had not left by their round.
async fn counting(tx: &mut Tx, id: TournamentId, mut games: Vec<Game>) -> Result<Vec<Game>> {
    let left: BTreeMap<TeamId, RoundNumber> = entrants::all(tx, id)
        .await?
        .into_iter()
        .filter_map(|entrant| Some((entrant.team, entrant.left?.from_round)))
        .collect();
    games.retain(|game| {
        let is_out = |team: &TeamId| {
            let of = game.purpose.meeting().zip(left.get(team));
            of.is_some_and(|(of, from)| of.round >= *from)
        };
        matches!(game.state, GameState::Played(_)) && !game.teams.iter().any(is_out)
    });
    Ok(games)
}

impl Store {
    /// Queues all games of all rounds `times` times more, with the same submissions and fresh seeds; they do not count and
    /// keep no recordings. Returns how many games. [`StoreError::Conflict`] if a round is to come or under way, or
    /// more than [`MAX_REPLAYS`], or [`MAX_REPLAYED_GAMES`], came of it.
    #[boxed]
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
            let schedule = games::of_rounds(tx, id).await?;
            let (started, all) = (rounds::count(tx, id).await?, tournament.rules.format.last_round());
            if started < all.get() {
                return Err(StoreError::Conflict(format!(
                    "a schedule is played again when all of it was played: {started} of {all} rounds were started"
                )));
            }
            let owed = games::owed(tx, id).await?.len();
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
            let schedule = counting(tx, id, schedule).await?;
            let queued = u32::try_from(schedule.len()).unwrap_or(u32::MAX);
            let games = queued.saturating_mul(last.saturating_add(times));
            if games > MAX_REPLAYED_GAMES {
                return Err(StoreError::Conflict(format!(
                    "times: {queued} games {} times are {games}, at most {MAX_REPLAYED_GAMES} are played again in all",
                    last.saturating_add(times)
                )));
            }
            let (mut count, mut account) = (0, None);
            for replay in last + 1..=last + times {
                for played in &schedule {
                    let Some(of) = played.purpose.meeting() else {
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
                    let account = match account {
                        Some(known) => known,
                        None => *account.insert(play::account(tx, &game, purpose::REPLAY_GAME).await?),
                    };
                    play::enqueue_for(tx, &game, purpose::REPLAY_GAME, account).await?;
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
    #[boxed]
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
