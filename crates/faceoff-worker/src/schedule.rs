//! The daily schedule. At a stage's *cutoff* its submissions are frozen, and the evaluations of that *day* start. A day whose
//! deadline has passed is ended.

use crate::boxed_future;
use anyhow::Context as _;
use faceoff_store::{Actor, Evaluation, RunPlan, Stage, Store};
use faceoff_types::{Clock, Competition, Profile, StepCause};
use jiff::Timestamp;
use std::sync::Arc;
use std::{num::NonZeroU32, time::Duration};
use tokio_util::sync::CancellationToken;

/// The longest sleep. A stage may be changed, a step of the clock accepted or the machine suspended meanwhile, and a day
/// must start in the second that pages show.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// Ends days whose deadline has passed and starts scheduled days at their cutoffs, each once, until `shutdown` is
/// cancelled. A day that became due while the server was down starts when the server is up again, if the date is still
/// the same. After a database error it tries again every second.
#[boxed_future]
pub async fn run_schedule(
    store: Store,
    competition: Arc<Competition>,
    clock: Clock,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let mut last_update_failed = false;
    loop {
        let now = clock.now();
        let next_start =
            match update_due_days_unless_behind(&store, &competition, &clock, now).await {
                Ok(next_start) => {
                    last_update_failed = false;
                    next_start
                }
                Err(error) => {
                    // Logged once, since it recurs every second.
                    if !last_update_failed {
                        tracing::error!(
                            error = format!("{error:#}"),
                            "days could not be ended or started; trying again"
                        );
                    }
                    last_update_failed = true;
                    None
                }
            };
        let wait = next_start.map_or(LONGEST_SLEEP, |start| {
            Duration::try_from(start.duration_since(now)).unwrap_or(Duration::ZERO)
        });
        tokio::select! {
            () = shutdown.cancelled() => return Ok(()),
            () = tokio::time::sleep(wait.min(LONGEST_SLEEP)) => {}
        }
    }
}

/// As [`update_due_days`], but nothing is due as long as the clock is behind the newest change in the database: the clock must be wrong
/// then, so the time is not known.
pub(crate) async fn update_due_days_unless_behind(
    store: &Store,
    competition: &Competition,
    clock: &Clock,
    now: Timestamp,
) -> anyhow::Result<Option<Timestamp>> {
    match clock.step() {
        Some(step) if step.cause == StepCause::NewestChange => Ok(None),
        _ => update_due_days(store, competition, now).await,
    }
}

/// Ends and starts all days that are due at `now`, and returns the time of the next start, if any. [`run_schedule`]
/// calls it at the right times.
#[boxed_future]
pub async fn update_due_days(
    store: &Store,
    competition: &Competition,
    now: Timestamp,
) -> anyhow::Result<Option<Timestamp>> {
    // A failure to end a day must not prevent others from starting.
    let ended = end_overdue(store, now).await;
    let mut earliest = None;
    let stages = store.stages().await.context("reading the stages")?;
    for stage in stages {
        let next = match next_cutoff(store, &stage, now).await? {
            Some(cutoff_at) if cutoff_at <= now => {
                let started = store.start_scheduled_day(stage.id, now).await;
                let started = started.with_context(|| format!("the stage {}", stage.name))?;
                if let Some(started) = started {
                    tracing::info!(stage = %stage.name, evaluations = started.len(), "day started");
                    create_ablations(store, competition, &stage, &started, now).await;
                }
                // If the cutoff is still due, something lasting prevents the start: do not retry at once.
                let next = next_cutoff(store, &stage, now).await?;
                next.filter(|cutoff_at| *cutoff_at > now)
            }
            next => next,
        };
        earliest = match (earliest, next) {
            (Some(earliest), Some(next)) => Some(std::cmp::min::<Timestamp>(earliest, next)),
            (earliest, next) => earliest.or(next),
        };
    }
    ended.map(|()| earliest)
}

async fn end_overdue(store: &Store, now: Timestamp) -> anyhow::Result<()> {
    let ended = store.end_overdue_days(now).await;
    for (day, unfinished) in ended.context("ending the days whose deadline has come")? {
        tracing::warn!(
            stage = %day.stage, day = %day.date, unfinished,
            "the day's deadline passed with evaluations not played"
        );
    }
    Ok(())
}

/// The time of the stage's next scheduled cutoff.
async fn next_cutoff(
    store: &Store,
    stage: &Stage,
    now: Timestamp,
) -> anyhow::Result<Option<Timestamp>> {
    let next = store.next_cutoff(stage, now).await;
    let next = next.context("reading the days")?;
    Ok(next.and_then(|(_, at)| at))
}

/// Creates an ablation (a comparison of the agent in several simulator profiles) for each submission that has none, if the
/// stage is configured so. Failures are only logged, since
/// counting evaluations must not depend on them; organisers can create the ablation by hand.
async fn create_ablations(
    store: &Store,
    competition: &Competition,
    stage: &Stage,
    started: &[Evaluation],
    now: Timestamp,
) {
    let Some(episodes) = NonZeroU32::new(stage.settings.ablation_episodes) else {
        return;
    };
    let plan = RunPlan {
        tasks: competition.task_names().collect(),
        episodes_per_task: episodes.get(),
        ..stage.plan()
    };
    let profiles: Vec<Profile> = competition.ablation_profiles().collect();
    let ruleset = competition.ruleset();
    for evaluation in started {
        let submission = evaluation.submission;
        let created = match store.newest_ablation(submission).await {
            Ok(Some(_)) => continue,
            Ok(None) => {
                store
                    .request_ablation(Actor::Schedule, submission, ruleset, &plan, &profiles, now)
                    .await
            }
            Err(error) => Err(error),
        };
        if let Err(error) = created {
            tracing::error!(%submission, %error, "an ablation could not be created");
        }
    }
}
