use crate::clock::Clock;
use anyhow::Context as _;
use faceoff_store::{Evaluation, EvaluationPlan, Store};
use jiff::{Timestamp, civil::Time, tz::TimeZone};
use std::{num::NonZeroU32, time::Duration};
use tokio_util::sync::CancellationToken;

/// The longest sleep: a machine's clock may be set, or the machine suspended, while we wait.
const LONGEST_SLEEP: Duration = Duration::from_secs(60);

/// What the schedule does each day.
#[derive(Debug, Clone)]
pub struct DailyPlan {
    /// The UTC time at which it does so.
    pub at: Time,
    /// What every team plays.
    pub evaluation: EvaluationPlan,
    /// Episodes of each task and profile of an ablation of every submission that was started and has
    /// none yet; `None`: no ablations.
    pub ablation_episodes: Option<NonZeroU32>,
}

/// Starts the evaluations of each UTC day once, at its time, until `shutdown` is cancelled. A day whose
/// time passed while the server was down is started when it comes up, the same day still. A failing
/// database is tried again every minute.
pub async fn run_schedule(
    store: Store,
    daily: DailyPlan,
    shutdown: CancellationToken,
) -> anyhow::Result<()> {
    run_by(store, daily, shutdown, Clock::system()).await
}

/// [`run_schedule`] by another clock.
pub(crate) async fn run_by(
    store: Store,
    daily: DailyPlan,
    shutdown: CancellationToken,
    clock: Clock,
) -> anyhow::Result<()> {
    loop {
        let now = clock.now();
        let wait = match until_next(now, daily.at)
            .context("reckoning the time of the daily start")?
        {
            Due::In(wait) => wait,
            Due::Today { next } => match store.start_scheduled_day(&daily.evaluation, now).await {
                Ok(Some(started)) => {
                    tracing::info!(evaluations = started.len(), "the day was started");
                    if let Some(episodes) = daily.ablation_episodes {
                        order_ablations(&store, &started, episodes, &daily.evaluation, now).await;
                    }
                    next
                }
                Ok(None) => next,
                Err(error) => {
                    tracing::error!(%error, "the day could not be started; trying again");
                    LONGEST_SLEEP
                }
            },
        };
        tokio::select! {
            () = shutdown.cancelled() => return Ok(()),
            () = tokio::time::sleep(wait.min(LONGEST_SLEEP)) => {}
        }
    }
}

/// Orders an ablation of each submission that has none. One that cannot be ordered is the organiser's
/// to order by hand: what counts must not wait for it.
async fn order_ablations(
    store: &Store,
    started: &[Evaluation],
    episodes: NonZeroU32,
    plan: &EvaluationPlan,
    now: Timestamp,
) {
    for evaluation in started {
        let submission = evaluation.submission;
        let ordered = match store.newest_ablation(submission).await {
            Ok(Some(_)) => continue,
            Ok(None) => {
                store
                    .create_ablation(submission, episodes.get(), plan.max_faults, now)
                    .await
            }
            Err(error) => Err(error),
        };
        if let Err(error) = ordered {
            tracing::error!(%submission, %error, "an ablation could not be ordered");
        }
    }
}

/// How the day stands.
#[derive(Debug, PartialEq, Eq)]
enum Due {
    /// Today's time has not come.
    In(Duration),
    /// Today's time has come; `next` is the way to tomorrow's.
    Today { next: Duration },
}

fn until_next(now: Timestamp, at: Time) -> Result<Due, jiff::Error> {
    let day = now.to_zoned(TimeZone::UTC).date();
    let start = |day: jiff::civil::Date| day.to_datetime(at).to_zoned(TimeZone::UTC);
    let wait = |until: jiff::Zoned| {
        Duration::try_from(until.timestamp().duration_since(now)).unwrap_or(Duration::ZERO)
    };
    let today = start(day)?;
    if now < today.timestamp() {
        Ok(Due::In(wait(today)))
    } else {
        Ok(Due::Today {
            next: wait(start(day.tomorrow()?)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(now: &str, at: &str) -> Due {
        until_next(now.parse().unwrap(), at.parse().unwrap()).unwrap()
    }

    #[test]
    fn a_day_is_due_from_its_time_on() {
        assert_eq!(
            due("2026-03-01T05:59:59Z", "06:00"),
            Due::In(Duration::from_secs(1))
        );
        let day = Duration::from_secs(86_400);
        assert_eq!(
            due("2026-03-01T06:00:00Z", "06:00"),
            Due::Today { next: day }
        );
        let hours = Duration::from_secs(7 * 3600);
        assert_eq!(
            due("2026-03-01T23:00:00Z", "06:00"),
            Due::Today { next: hours }
        );
        // another zone's wall clock is no matter
        assert_eq!(
            due("2026-03-01T00:30:00+01:00", "00:00"),
            Due::Today {
                next: Duration::from_secs(1800)
            }
        );
    }
}
