//! Repetitions of a tournament's schedule, called *replays* in the API and the database: all games are played again with new
//! seeds, to show how certain the winner is.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{job_purpose, tournament::game_lifecycle},
    store::Store,
    tables::{
        entrants,
        games::{self, Game, GamePurpose, GameState},
        rounds, season, tournaments,
    },
    write::Tx,
};
use faceoff_types::{GameId, GameSeedLabel, RoundNumber, TeamId, TournamentId};
use jiff::Timestamp;
use std::collections::BTreeMap;

/// Maximum number of repetitions of a schedule.
pub const MAX_SCHEDULE_REPLAYS: u32 = 1000;

/// Maximum number of games in all repetitions of a tournament's schedule: they are queued at once, and read at once.
pub const MAX_REPLAYED_GAMES: u32 = 10_000;

/// The games that count: they have a result, and neither team had left the tournament by their round.
async fn counting_games(tx: &mut Tx, id: TournamentId, mut games: Vec<Game>) -> Result<Vec<Game>> {
    let departure_rounds: BTreeMap<TeamId, RoundNumber> = entrants::all(tx, id)
        .await?
        .into_iter()
        .filter_map(|entrant| Some((entrant.team, entrant.departure?.from_round)))
        .collect();
    games.retain(|game| {
        let had_left = |team: &TeamId| {
            let game_and_departure_rounds = game
                .purpose
                .schedule_entry()
                .zip(departure_rounds.get(team));
            game_and_departure_rounds
                .is_some_and(|(schedule_entry, from_round)| schedule_entry.round >= *from_round)
        };
        matches!(game.state, GameState::Played(_)) && !game.teams.iter().any(had_left)
    });
    Ok(games)
}

impl Store {
    /// Queues all games of all rounds again, `times` times, with the same submissions and new seeds. The games do not
    /// count and are not recorded. Returns the number of games. [`StoreError::Conflict`] if not all rounds are over, or
    /// beyond [`MAX_SCHEDULE_REPLAYS`] or [`MAX_REPLAYED_GAMES`].
    #[boxed_future]
    pub async fn request_schedule_replays(
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
            let (started, rounds) = (rounds::count(tx, id).await?, tournament.rules.format.last_round());
            if started < rounds.get() {
                return StoreError::conflict(format!(
                    "a schedule can be replayed once all its games are over: {started} of {rounds} rounds have started"
                ));
            }
            let pending = games::pending_of_rounds(tx, id).await?.len();
            if pending > 0 {
                return StoreError::conflict(format!(
                    "a schedule can be replayed once all its games are over: {pending} games have no result yet"
                ));
            }
            let last = games::last_replay(tx, id).await?;
            if times == 0 || times > MAX_SCHEDULE_REPLAYS - last.min(MAX_SCHEDULE_REPLAYS) {
                return StoreError::conflict(format!(
                    "times: expected 1 to {}, since {last} of {MAX_SCHEDULE_REPLAYS} replays exist; got {times}",
                    MAX_SCHEDULE_REPLAYS.saturating_sub(last)
                ));
            }
            let schedule = counting_games(tx, id, schedule).await?;
            let queued = u32::try_from(schedule.len()).unwrap_or(u32::MAX);
            let games = queued.saturating_mul(last.saturating_add(times));
            if games > MAX_REPLAYED_GAMES {
                return StoreError::conflict(format!(
                    "times: {queued} games {} times are {games}; expected at most {MAX_REPLAYED_GAMES} in all",
                    last.saturating_add(times)
                ));
            }
            let (mut count, mut account) = (0, None);
            for replay in last + 1..=last + times {
                for original_game in &schedule {
                    let Some(original) = original_game.purpose.schedule_entry() else {
                        continue;
                    };
                    let game = Game {
                        id: GameId::new(),
                        purpose: GamePurpose::ScheduleReplay { replay, original },
                        seed: GameSeedLabel::ScheduleReplay {
                            tournament: tournament.number,
                            replay,
                            round: original.round,
                            meeting: original.pairing,
                        },
                        created_at: now,
                        state: GameState::Queued,
                        ..original_game.clone()
                    };
                    let account = match account {
                        Some(account) => account,
                        None => *account.insert(game_lifecycle::open_account(tx, &game, job_purpose::SCHEDULE_REPLAY_GAME).await?),
                    };
                    game_lifecycle::enqueue_for(tx, &game, job_purpose::SCHEDULE_REPLAY_GAME, account).await?;
                    count += 1;
                }
            }
            let event = Event::ScheduleReplaysRequested {
                times,
                games: count,
            };
            tx.record(Subject::Tournament(id), event);
            Ok(count)
        })
        .await
    }

    /// Cancels the replays that are not over. Returns the number of games.
    #[boxed_future]
    pub async fn cancel_schedule_replays(
        &self,
        actor: Actor,
        id: TournamentId,
        now: Timestamp,
    ) -> Result<u32> {
        self.write(actor, now, async |tx| {
            tournaments::find_open(tx, id).await?;
            let mut count = 0;
            for game in games::unfinished(tx, id).await? {
                if let GamePurpose::ScheduleReplay { .. } = game.purpose {
                    game_lifecycle::cancel(tx, &game, "the organisers cancelled the replays")
                        .await?;
                    count += 1;
                }
            }
            if count > 0 {
                tx.record(
                    Subject::Tournament(id),
                    Event::ScheduleReplaysCancelled { games: count },
                );
            }
            Ok(count)
        })
        .await
    }
}
