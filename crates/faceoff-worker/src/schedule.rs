use crate::boxed;
use anyhow::Context as _;
use faceoff_store::{Actor, Evaluation, RunPlan, Stage, Store};
use faceoff_types::Clock;
use jiff::Timestamp;
use std::{num::NonZeroU32, time::Duration};
use tokio_util::sync::CancellationToken;

/// The longest sleep: a stage may be changed, a machine's clock set, or the machine suspended, while we wait, and
/// a day is to start within the second that is shown.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// Ends the days whose deadline has come, and starts those of all stages that have a schedule, each once, at its
/// time, until `shutdown` is cancelled. A day whose time passed while the server was down is started when it comes
/// up, on the same date still. What a failing database keeps from ending or starting is tried again every second.
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
                // Once: it comes again every second.
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

/// Ends and starts what is due at `now`; when the next day is, if one comes. [`run_schedule`] does so at the right
/// times.
#[boxed]
pub async fn start_due(store: &Store, now: Timestamp) -> anyhow::Result<Option<Timestamp>> {
    // A day that cannot be ended keeps no other from starting.
    let ended = end_overdue(store, now).await;
    let mut first = None;
    let stages = store.stages().await.context("reading the stages")?;
    for stage in stages {
        let next = match next_cut(store, &stage, now).await? {
            Some(at) if at <= now => {
                let started = store.start_scheduled_day(stage.id, now).await;
                let started = started.with_context(|| format!("the stage {}", stage.name))?;
                if let Some(started) = started {
                    tracing::info!(stage = %stage.name, evaluations = started.len(), "the day was started");
                    order_ablations(store, &stage, &started, now).await;
                }
                // It is not due again unless something keeps it from starting, which may last.
                let next = next_cut(store, &stage, now).await?;
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
            "the day's deadline came before all of it was played"
        );
    }
    Ok(())
}

/// When the schedule starts the stage's next day.
async fn next_cut(
    store: &Store,
    stage: &Stage,
    now: Timestamp,
) -> anyhow::Result<Option<Timestamp>> {
    let newest = store
        .newest_day(stage.id)
        .await
        .context("reading the days")?;
    let next = stage.next_cut(newest.map(|day| day.of.date), now);
    Ok(next.and_then(|(_, at)| at))
}

/// Orders an ablation of each submission that has none, if the stage wants them. One that cannot be ordered is the
/// organiser's to order by hand: what counts must not wait for it.
async fn order_ablations(store: &Store, stage: &Stage, started: &[Evaluation], now: Timestamp) {
    let Some(episodes) = NonZeroU32::new(stage.settings.ablation_episodes) else {
        return;
    };
    let plan = RunPlan {
        episodes_per_task: episodes.get(),
        ..stage.plan()
    };
    for evaluation in started {
        let submission = evaluation.submission;
        let ordered = match store.newest_ablation(submission).await {
            Ok(Some(_)) => continue,
            Ok(None) => {
                store
                    .create_ablation(Actor::Schedule, submission, &plan, now)
                    .await
            }
            Err(error) => Err(error),
        };
        if let Err(error) = ordered {
            tracing::error!(%submission, %error, "an ablation could not be ordered");
        }
    }
}
