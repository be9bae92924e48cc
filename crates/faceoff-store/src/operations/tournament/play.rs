//! A game from the queue to its result, or to what kept it from one.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Event, Subject},
    operations::{
        commit::{Committed, other_work},
        purpose::Purpose,
        work::{RunSeeds, Work},
    },
    queue::{self, Account, Claim, NewUnit},
    store::Store,
    tables::{
        bundles,
        game_attempts::{self, AttemptOutcome},
        game_transitions::{self, NoResult},
        games::{self, Game, GameCommit, GamePurpose},
        rounds, season, submissions, tournaments,
    },
    write::Tx,
};
use faceoff_types::{BundleRef, GameId, RoundNumber, TournamentId};
use jiff::Timestamp;
use uuid::Uuid;

/// Whose slot time the games of a tournament, or those that a team asked for, take. To be asked once for many: the
/// answer looks at all that waits.
pub(super) async fn account(tx: &mut Tx, game: &Game, waiting: NewUnit) -> Result<Account> {
    let holder = match game.purpose {
        GamePurpose::Round(_)
        | GamePurpose::Replay { .. }
        | GamePurpose::Test { asked_by: None } => game.tournament.to_string(),
        GamePurpose::Test {
            asked_by: Some(team),
        }
        | GamePurpose::Friendly { asked_by: team } => team.to_string(),
    };
    queue::account(tx, waiting.lane, &holder).await
}

/// What waits in the queue for a game. Games of a round wait matchday by matchday.
async fn unit(tx: &mut Tx, game: &Game, waiting: NewUnit, account: Account) -> Result<Uuid> {
    for submission in game.submissions {
        bundles::check_kept(tx, submission).await?;
    }
    let batch = match game.purpose {
        GamePurpose::Round(meeting) => i64::from(meeting.matchday),
        GamePurpose::Replay { replay, .. } => i64::from(replay),
        GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => 0,
    };
    queue::insert(tx, NewUnit { batch, ..waiting }, account).await
}

/// Adds a game and queues it. [`StoreError::Conflict`] if the archive of a side was removed.
pub(super) async fn enqueue(tx: &mut Tx, game: &Game, waiting: NewUnit) -> Result<()> {
    let account = account(tx, game, waiting).await?;
    enqueue_for(tx, game, waiting, account).await
}

/// As [`enqueue`], for an account that was looked up.
pub(super) async fn enqueue_for(
    tx: &mut Tx,
    game: &Game,
    waiting: NewUnit,
    account: Account,
) -> Result<()> {
    let unit = unit(tx, game, waiting, account).await?;
    games::insert(tx, game, unit).await
}

/// Queues a game that has no result once more.
pub(super) async fn enqueue_again(tx: &mut Tx, game: &Game, waiting: NewUnit) -> Result<()> {
    let account = account(tx, game, waiting).await?;
    let unit = unit(tx, game, waiting, account).await?;
    game_transitions::set_queued_again(tx, game.id, unit).await
}

/// A slot has claimed a game: what it is to do. `None` if the tournament is paused: then the unit is not to be begun.
pub(crate) async fn begin(
    tx: &mut Tx,
    id: GameId,
    worker: &str,
    platform_retries: u32,
) -> Result<Option<Work>> {
    let game = games::find(tx, id).await?;
    let tournament = tournaments::find(tx, game.tournament).await?;
    let now = tx.now;
    // Whoever had it is dead, or its lease would not have been given away.
    game_attempts::end(tx, id, AttemptOutcome::Lost, None, now).await?;
    game_transitions::set_waiting(tx, id).await?;
    if tournament.paused.is_some() {
        return Ok(None);
    }
    let secret = season::read(tx).await?.secret;
    let mut bundles: [Option<BundleRef>; 2] = [None, None];
    for (bundle, submission) in bundles.iter_mut().zip(game.submissions) {
        *bundle = Some(submissions::find(tx, submission).await?.bundle);
    }
    let [Some(home), Some(away)] = bundles else {
        return Err(StoreError::NotFound("submission"));
    };
    let attempt = game_attempts::begin(tx, id, worker, now).await?;
    game_transitions::set_running(tx, id, attempt).await?;
    tx.record(Subject::Game(id), Event::GameBegun { attempt });
    Ok(Some(Work::Game {
        game: id,
        rules: Box::new(tournament.rules),
        bundles: [home, away],
        seeds: RunSeeds {
            episodes: game.seed.seed(&secret),
            mismatch: secret.model_mismatch(),
        },
        attempt,
        platform_retries,
        keeps_recording: game.purpose.keeps_recording(),
    }))
}

/// The attempt that is under way has ended without a result, and the game waits for another.
pub(crate) async fn give_back(
    tx: &mut Tx,
    id: GameId,
    how: AttemptOutcome,
    reason: Option<&str>,
) -> Result<()> {
    let now = tx.now;
    game_attempts::end(tx, id, how, reason, now).await?;
    game_transitions::set_waiting(tx, id).await
}

/// Our fault, given up: it has no result until an organiser has it played again.
pub(crate) async fn give_up(tx: &mut Tx, id: GameId, reason: &str) -> Result<()> {
    let now = tx.now;
    game_attempts::end(tx, id, AttemptOutcome::Lost, Some(reason), now).await?;
    game_transitions::set_without_result(tx, id, NoResult::Broken, reason, now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Game(id), Event::GameBroken { reason });
    match games::find(tx, id).await {
        Ok(game) => end_round_if_its(tx, &game).await,
        // It must end all the same: it would hold up the queue.
        Err(StoreError::Damaged(what)) => {
            tracing::error!(game = %id, what, "a damaged game has ended");
            Ok(())
        }
        Err(error) => Err(error),
    }
}

/// Takes a game out of the queue, whoever plays it.
pub(super) async fn call_off(tx: &mut Tx, game: &Game, reason: &str) -> Result<()> {
    let unit = games::unit_of(tx, game.id).await?;
    queue::drop_units(tx, &[unit]).await?;
    let now = tx.now;
    game_attempts::end(tx, game.id, AttemptOutcome::CalledOff, Some(reason), now).await?;
    game_transitions::set_without_result(tx, game.id, NoResult::Cancelled, reason, now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Game(game.id), Event::GameCancelled { reason });
    Ok(())
}

async fn end_round_if_its(tx: &mut Tx, game: &Game) -> Result<()> {
    match game.purpose {
        GamePurpose::Round(meeting) => end_round_if_over(tx, game.tournament, meeting.round).await,
        GamePurpose::Test { .. } | GamePurpose::Friendly { .. } | GamePurpose::Replay { .. } => {
            Ok(())
        }
    }
}

/// Notes that a round is over if no game of it is owed a result.
pub(super) async fn end_round_if_over(
    tx: &mut Tx,
    id: TournamentId,
    round: RoundNumber,
) -> Result<()> {
    let owed = games::owed(tx, id).await?;
    let is_owed = owed.iter().any(|owed| owed.round == round);
    let now = tx.now;
    if !is_owed && rounds::set_over(tx, id, round, now).await? {
        tx.record(Subject::Tournament(id), Event::RoundOver { round });
    }
    Ok(())
}

impl Store {
    /// Stores what playing a game yielded. Idempotent, as [`Store::commit_shard`] is.
    #[boxed]
    pub async fn commit_game(
        &self,
        claim: &Claim,
        commit: &GameCommit,
        now: Timestamp,
    ) -> Result<Committed> {
        self.commit(claim, now, async |tx, purpose| {
            let Purpose::Game(id) = purpose else {
                return Err(other_work("game", &purpose));
            };
            let game = games::find(tx, id).await?;
            if commit.recording.is_some() != game.purpose.keeps_recording() {
                return Err(StoreError::Conflict(
                    "the recording of a game is stored, and that of a schedule played again is not"
                        .into(),
                ));
            }
            let attempt = game_attempts::commit(tx, id, commit, now).await?;
            game_transitions::set_played(tx, id, attempt, now).await?;
            tx.record(Subject::Game(id), Event::GamePlayed { attempt });
            end_round_if_its(tx, &game).await
        })
        .await
    }
}
