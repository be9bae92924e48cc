use crate::{
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::{purpose, release_day::utc_day, runs},
    reads,
    store::Store,
    tables::{
        evaluations::{self, Evaluation, NewEvaluation},
        plan::RunPlan,
        released_days,
        runs::Run,
        season,
        submissions::{self, Submission, SubmissionState},
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Ruleset, RunId, SeedLabel, SubmissionId};
use jiff::{Timestamp, civil::Date};

/// Takes the turn of `day` and queues the shards.
async fn queue_evaluation(
    tx: &mut Tx,
    submission: &Submission,
    plan: &RunPlan,
    day: Date,
) -> Result<Evaluation> {
    let run = Run {
        id: RunId::new(),
        ruleset: Ruleset::CURRENT,
        plan: plan.clone(),
        seed: SeedLabel::Day(day),
        keeps_recordings: true,
    };
    runs::create(tx, &run, &[submission.id], purpose::SHARD).await?;
    let new = NewEvaluation {
        id: EvaluationId::new(),
        submission: submission.id,
        team: submission.team,
        day,
        run: run.id,
    };
    let now = tx.now;
    evaluations::insert(tx, &new, now).await?;
    tx.record(
        Subject::Evaluation(new.id),
        Event::EvaluationQueued {
            team: new.team,
            submission: new.submission,
            day,
            run: new.run,
        },
    );
    reads::evaluations::find(tx, new.id).await
}

/// Starts every team that has a valid submission and has not used its turn of the day.
async fn start_teams(tx: &mut Tx, plan: &RunPlan, day: Date) -> Result<Vec<Evaluation>> {
    plan.check()?;
    season::check_open(tx).await?;
    let released_at = released_days::released_at(tx, day).await?;
    let mut started = Vec::new();
    for submission in submissions::awaiting_turn(tx, day, released_at).await? {
        started.push(queue_evaluation(tx, &submission, plan, day).await?);
    }
    if !started.is_empty() {
        let evaluations = u32::try_from(started.len()).unwrap_or(u32::MAX);
        tx.record(Subject::Day(day), Event::DayStarted { evaluations });
    }
    Ok(started)
}

/// Refuses a submission that cannot be evaluated, with what to do about it.
fn check_valid(submission: &Submission) -> Result<()> {
    Err(StoreError::Conflict(match &submission.state {
        SubmissionState::Valid => return Ok(()),
        SubmissionState::Validating => {
            "the submission's smoke run is not over: wait until it is valid".into()
        }
        SubmissionState::Invalid { reason } => {
            format!("the submission is invalid ({reason}): upload a corrected one")
        }
        SubmissionState::ValidationError { .. } => {
            "the submission could not be checked, by our fault: upload it again".into()
        }
    }))
}

impl Store {
    /// Queues an evaluation of a valid submission, taking its team's turn of `now`'s UTC day.
    /// [`StoreError::AlreadyEvaluated`] if the turn is used, [`StoreError::DayReleased`] if the
    /// submission came after the release of the day's seed, [`StoreError::SeasonClosed`] once the
    /// season is over, [`StoreError::Conflict`] if the submission is not valid (yet) or the plan is
    /// empty.
    pub async fn create_evaluation(
        &self,
        actor: Actor,
        submission: SubmissionId,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Evaluation> {
        plan.check()?;
        self.write(actor, now, async |tx| {
            season::check_open(tx).await?;
            let submission = submissions::find(tx, submission).await?;
            check_valid(&submission)?;
            let day = utc_day(now);
            let evaluation = queue_evaluation(tx, &submission, plan, day).await?;
            // after the insertion: that the turn is used says more
            if let Some(released_at) = released_days::released_at(tx, day).await?
                && submission.created_at >= released_at
                && let Ok(next) = day.tomorrow()
            {
                return Err(StoreError::DayReleased {
                    day,
                    released_at,
                    next,
                });
            }
            Ok(evaluation)
        })
        .await
    }

    /// Starts the day: queues an evaluation of the newest valid submission of each team that has not
    /// used its turn of `now`'s UTC day, earliest submission first; once the day's seed is released,
    /// of those uploaded before. Returns what was created. [`StoreError::SeasonClosed`] once the
    /// season is over.
    pub async fn start_day(
        &self,
        actor: Actor,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Vec<Evaluation>> {
        self.write(actor, now, async |tx| {
            start_teams(tx, plan, utc_day(now)).await
        })
        .await
    }

    /// Starts `now`'s UTC day once, whoever asks and however often: the note that the day was started
    /// and its evaluations are one transaction. `None` if the schedule has started it before, or
    /// the season is closed.
    pub async fn start_scheduled_day(
        &self,
        plan: &RunPlan,
        now: Timestamp,
    ) -> Result<Option<Vec<Evaluation>>> {
        self.write(Actor::Schedule, now, async |tx| {
            let day = utc_day(now);
            if season::read(tx).await?.closed_at.is_some()
                || !season::note_scheduled_day(tx, day).await?
            {
                return Ok(None);
            }
            start_teams(tx, plan, day).await.map(Some)
        })
        .await
    }
}
