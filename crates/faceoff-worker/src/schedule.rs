use crate::boxed;
use anyhow::Context as _;
use faceoff_store::{Actor, Evaluation, RunPlan, Stage, Store};
use faceoff_types::Clock;
use jiff::Timestamp;
use std::{num::NonZeroU32, time::Duration};
use tokio_util::sync::CancellationToken;

/// The longest sleep. A stage may be changed, the clock set or the machine suspended meanwhile, and a day must start in
/// the second that pages show.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// Ends overdue days and starts scheduled days at their times, each once, until `shutdown` is cancelled. A day that
/// became due while the server was down starts when the server is up again, if the date is still the same. After a
/// database error it tries again every second.
#[boxed]
pub async fn run_schedule(
    store: Store,
    clock: Clock,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    let mut failed = false;
    loop {
        let now = clock.now();
        let next = match start_due(&store, now).await {
            Ok(next) => {
                failed = false;
                next
            }
            Err(error) => {
                // Logged once, since it recurs every second.
                if !failed {
                    tracing::error!(
                        error = format!("{error:#}"),
                        "days could not be ended or started; trying again"
                    );
                }
                failed = true;
                None
            }
        };
        let wait = next.map_or(LONGEST_SLEEP, |at| {
            Duration::try_from(at.duration_since(now)).unwrap_or(Duration::ZERO)
        });
        tokio::select! {
            () = shutdown.cancelled() => return Ok(()),
            () = tokio::time::sleep(wait.min(LONGEST_SLEEP)) => {}
        }
    }
}

/// Ends and starts all days that are due at `now`, and returns the time of the next start, if any. [`run_schedule`]
/// calls it at the right times.
#[boxed]
pub async fn start_due(store: &Store, now: Timestamp) -> anyhow::Result<Option<Timestamp>> {
    // A failure to end a day must not prevent others from starting.
    let ended = end_overdue(store, now).await;
    let mut first = None;
    let stages = store.stages().await.context("reading the stages")?;
    for stage in stages {
        let next = match next_cutoff(store, &stage, now).await? {
            Some(at) if at <= now => {
                let started = store.start_scheduled_day(stage.id, now).await;
                let started = started.with_context(|| format!("the stage {}", stage.name))?;
                if let Some(started) = started {
                    tracing::info!(stage = %stage.name, evaluations = started.len(), "day started");
                    create_ablations(store, &stage, &started, now).await;
                }
                // If it is still due, something lasting prevents the start: do not retry at once.
                let next = next_cutoff(store, &stage, now).await?;
                next.filter(|at| *at > now)
            }
            next => next,
        };
        first = match (first, next) {
            (Some(first), Some(next)) => Some(std::cmp::min::<Timestamp>(first, next)),
            (first, next) => first.or(next),
        };
    }
    ended.map(|()| first)
}

async fn end_overdue(store: &Store, now: Timestamp) -> anyhow::Result<()> {
    let ended = store.end_overdue_days(now).await;
    for (of, not_played) in ended.context("ending the days whose deadline has come")? {
        tracing::warn!(
            stage = %of.stage, day = %of.date, not_played,
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
    let newest = store
        .newest_day(stage.id)
        .await
        .context("reading the days")?;
    let next = stage.next_cutoff(newest.map(|day| day.stage_day.date), now);
    Ok(next.and_then(|(_, at)| at))
}

/// Creates an ablation for each submission that has none, if the stage is configured so. Failures are only logged, since
/// counting evaluations must not depend on them; organisers can create the ablation by hand.
async fn create_ablations(store: &Store, stage: &Stage, started: &[Evaluation], now: Timestamp) {
    let Some(episodes) = NonZeroU32::new(stage.settings.ablation_episodes) else {
        return;
    };
    let plan = RunPlan {
        episodes_per_task: episodes.get(),
        ..stage.plan()
    };
    for evaluation in started {
        let submission = evaluation.submission;
        let created = match store.newest_ablation(submission).await {
            Ok(Some(_)) => continue,
            Ok(None) => {
                store
                    .request_ablation(Actor::Schedule, submission, &plan, now)
                    .await
            }
            Err(error) => Err(error),
        };
        if let Err(error) = created {
            tracing::error!(%submission, %error, "an ablation could not be created");
        }
    }
}
