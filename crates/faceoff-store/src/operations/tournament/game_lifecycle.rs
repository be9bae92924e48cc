//! Lifecycle of a tournament's game: it is queued, started in one or more attempts, and ended with or without a result.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Event, Subject},
    operations::{
        commit_job::{CommitOutcome, wrong_job},
        job_purpose::JobPurpose,
        jobs::{Job, RunSeeds},
    },
    queue::{self, JobClaim, NewJob, SlotTimeAccount},
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

/// The account charged with a game's slot time: that of the tournament, or of the team that requested the game. For many
/// games it is looked up once, since the lookup reads the whole queue.
pub(super) async fn open_account(tx: &mut Tx, game: &Game, job: NewJob) -> Result<SlotTimeAccount> {
    let owner = match game.purpose {
        GamePurpose::Round(_)
        | GamePurpose::ScheduleReplay { .. }
        | GamePurpose::Test { asked_by: None } => game.tournament.to_string(),
        GamePurpose::Test {
            asked_by: Some(team),
        }
        | GamePurpose::Friendly { asked_by: team } => team.to_string(),
    };
    queue::open_account(tx, job.lane, &owner).await
}

/// Adds a game's job to the queue. Games of a round are queued by matchday (the games that teams play at the same time).
async fn insert_job(
    tx: &mut Tx,
    game: &Game,
    job: NewJob,
    account: SlotTimeAccount,
) -> Result<Uuid> {
    for submission in game.submissions {
        bundles::check_available(tx, submission).await?;
    }
    let batch = match game.purpose {
        GamePurpose::Round(schedule_entry) => i64::from(schedule_entry.matchday),
        GamePurpose::ScheduleReplay { replay, .. } => i64::from(replay),
        GamePurpose::Test { .. } | GamePurpose::Friendly { .. } => 0,
    };
    queue::insert(tx, NewJob { batch, ..job }, account).await
}

/// Adds a game and queues it. [`StoreError::Conflict`] if the bundle of one of the
/// two submissions was removed.
pub(super) async fn enqueue(tx: &mut Tx, game: &Game, job: NewJob) -> Result<()> {
    let account = open_account(tx, game, job).await?;
    enqueue_for(tx, game, job, account).await
}

/// [`enqueue`] with an account that was looked up before.
pub(super) async fn enqueue_for(
    tx: &mut Tx,
    game: &Game,
    job: NewJob,
    account: SlotTimeAccount,
) -> Result<()> {
    let job_id = insert_job(tx, game, job, account).await?;
    games::insert(tx, game, job_id).await
}

/// Queues a game without a result again.
pub(super) async fn enqueue_again(tx: &mut Tx, game: &Game, job: NewJob) -> Result<()> {
    let account = open_account(tx, game, job).await?;
    let job_id = insert_job(tx, game, job, account).await?;
    game_transitions::requeue(tx, game.id, job_id).await
}

/// Starts an attempt of a claimed game. `None` if the tournament is paused: the job must not start.
pub(crate) async fn begin(
    tx: &mut Tx,
    id: GameId,
    worker: &str,
    platform_retries: u32,
) -> Result<Option<Job>> {
    let game = games::find(tx, id).await?;
    let tournament = tournaments::find(tx, game.tournament).await?;
    let now = tx.now;
    // The worker of an earlier attempt is dead, otherwise its lease would not have expired.
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
    Ok(Some(Job::Game {
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

/// Ends the running attempt without a result; the game waits for another attempt.
pub(crate) async fn end_attempt(
    tx: &mut Tx,
    id: GameId,
    outcome: AttemptOutcome,
    reason: Option<&str>,
) -> Result<()> {
    let now = tx.now;
    game_attempts::end(tx, id, outcome, reason, now).await?;
    game_transitions::set_waiting(tx, id).await
}

/// Gives a game up after platform faults: it has no result until an organiser reruns it.
pub(crate) async fn give_up(tx: &mut Tx, id: GameId, reason: &str) -> Result<()> {
    let now = tx.now;
    game_attempts::end(tx, id, AttemptOutcome::Lost, Some(reason), now).await?;
    game_transitions::set_without_result(tx, id, NoResult::PlatformFailed, reason, now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Game(id), Event::GamePlatformFailed { reason });
    match games::find(tx, id).await {
        Ok(game) => end_round_of_game(tx, &game).await,
        // A damaged game must end, too: it would block the queue otherwise.
        Err(StoreError::Damaged(defect)) => {
            tracing::error!(game = %id, defect, "ended a damaged game");
            Ok(())
        }
        Err(error) => Err(error),
    }
}

/// Cancels a game, also if it is running.
pub(super) async fn cancel(tx: &mut Tx, game: &Game, reason: &str) -> Result<()> {
    let job = games::job_of(tx, game.id).await?;
    queue::drop_jobs(tx, &[job]).await?;
    let now = tx.now;
    game_attempts::end(tx, game.id, AttemptOutcome::Cancelled, Some(reason), now).await?;
    game_transitions::set_without_result(tx, game.id, NoResult::Cancelled, reason, now).await?;
    let reason = reason.to_owned();
    tx.record(Subject::Game(game.id), Event::GameCancelled { reason });
    Ok(())
}

async fn end_round_of_game(tx: &mut Tx, game: &Game) -> Result<()> {
    match game.purpose {
        GamePurpose::Round(schedule_entry) => {
            end_round_if_over(tx, game.tournament, schedule_entry.round).await
        }
        GamePurpose::Test { .. }
        | GamePurpose::Friendly { .. }
        | GamePurpose::ScheduleReplay { .. } => Ok(()),
    }
}

/// Marks a round as over if all its games have their result.
pub(super) async fn end_round_if_over(
    tx: &mut Tx,
    id: TournamentId,
    round: RoundNumber,
) -> Result<()> {
    let pending = games::pending_of_rounds(tx, id).await?;
    let is_pending = pending.iter().any(|pending| pending.round == round);
    let now = tx.now;
    if !is_pending && rounds::set_ended(tx, id, round, now).await? {
        tx.record(Subject::Tournament(id), Event::RoundOver { round });
    }
    Ok(())
}

impl Store {
    /// Stores the result of a game. Idempotent, as [`Store::commit_shard`] is.
    #[boxed_future]
    pub async fn commit_game(
        &self,
        claim: &JobClaim,
        commit: &GameCommit,
        now: Timestamp,
    ) -> Result<CommitOutcome> {
        self.commit(claim, now, async |tx, purpose| {
            let JobPurpose::Game(id) = purpose else {
                return Err(wrong_job("game", &purpose));
            };
            let game = games::find(tx, id).await?;
            if commit.recording.is_some() != game.purpose.keeps_recording() {
                return StoreError::conflict(
                    "expected a recording of a game, and none of a game of a replayed schedule",
                );
            }
            let attempt = game_attempts::commit(tx, id, commit, now).await?;
            game_transitions::set_played(tx, id, attempt, now).await?;
            tx.record(Subject::Game(id), Event::GamePlayed { attempt });
            end_round_of_game(tx, &game).await
        })
        .await
    }
}
