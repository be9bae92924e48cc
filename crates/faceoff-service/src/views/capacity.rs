//! Capacity forecast: whether the evaluations of a day fit into the slots and the time available.

use crate::{app::AppState, boxed, config::Capacity, problem::Problem};
use faceoff_api::views::capacity::{CapacityView, DayLoad, Fit};
use faceoff_store::{EvaluationBacklog, JobDurations, Stage, Store, StoreError};
use faceoff_types::{StageId, TeamId};
use jiff::{Timestamp, civil::Date};

/// Remaining work of a day, independent of the number of slots.
struct Load {
    day: Date,
    is_under_way: bool,
    teams: u32,
    episodes: u32,
    expected_ms: Option<f64>,
    longest_s: f64,
    /// The deadline, and the hours until then.
    deadline: Option<(Timestamp, f64)>,
}

fn hours(from: Timestamp, to: Timestamp) -> f64 {
    to.duration_since(from).as_secs_f64() / 3600.0
}

fn day_load(load: &Load, slots: u32) -> DayLoad {
    let slots = f64::from(slots.max(1));
    let worst_case_hours = load.longest_s / slots / 3600.0;
    let expected_hours = load.expected_ms.map(|ms| ms / 1000.0 / slots / 3600.0);
    let available = load.deadline.map(|(_, hours)| hours);
    let fit = match (available, expected_hours) {
        (None, _) => Fit::Surely,
        (Some(available), _) if worst_case_hours <= available => Fit::Surely,
        (Some(available), Some(expected)) if expected <= available => Fit::Probably,
        (Some(_), Some(_)) => Fit::Not,
        (Some(_), None) => Fit::Unknown,
    };
    let mut view = DayLoad {
        day: load.day,
        is_under_way: load.is_under_way,
        teams: load.teams,
        episodes: load.episodes,
        expected_hours,
        worst_case_hours,
        deadline_at: load.deadline.map(|(at, _)| at),
        hours_until_deadline: available,
        fit,
        summary: String::new(),
    };
    view.summary = summary(&view);
    view
}

fn summary(day: &DayLoad) -> String {
    let teams = match (day.is_under_way, day.teams) {
        (true, 0) => {
            return format!(
                "{}: all episodes are done, scores are being computed.",
                day.day
            );
        }
        (false, 0) => return format!("{}: no team has a valid submission yet.", day.day),
        (true, 1) => "1 team has".to_owned(),
        (true, teams) => format!("{teams} teams have"),
        (false, 1) => "1 team would have".to_owned(),
        (false, teams) => format!("{teams} teams would have"),
    };
    let expected = match day.expected_hours {
        Some(hours) => format!("{hours:.1} hours expected, as measured in the last seven days"),
        None => "duration unknown (nothing measured in the last seven days)".to_owned(),
    };
    let load = format!(
        "{}: {teams} {} episodes to run: {expected}; at most {:.1} hours, if every agent uses up its time",
        day.day, day.episodes, day.worst_case_hours
    );
    let Some(available) = day.hours_until_deadline else {
        return format!("{load}. No deadline.");
    };
    let advice = "more slots, fewer episodes or a later deadline (day_deadline) would help";
    match day.fit {
        Fit::Surely => format!("{load}. The day has {available:.1} hours: it fits."),
        Fit::Probably => format!(
            "{load}. The day has {available:.1} hours: it probably fits, unless agents use up their time."
        ),
        Fit::Unknown => format!(
            "{load}. The day has {available:.1} hours: evaluations of slow agents may not finish; {advice}."
        ),
        Fit::Not => format!(
            "{load}. The day has {available:.1} hours: it does not fit, and evaluations that are not finished at the \
             deadline do not count; {advice}."
        ),
    }
}

fn next_load(
    stage: &Stage,
    day: Date,
    cut_at: Timestamp,
    teams: &[TeamId],
    measured: &JobDurations,
    capacity: &Capacity,
) -> Load {
    let plan = stage.plan();
    let episodes = plan.episodes_total();
    let tasks = u32::try_from(plan.tasks.len()).unwrap_or(u32::MAX);
    let shards = tasks.saturating_mul(
        plan.episodes_per_task
            .div_ceil(plan.episodes_per_shard.max(1)),
    );
    let count = u32::try_from(teams.len()).unwrap_or(u32::MAX);
    let expected = teams
        .iter()
        .map(|team| Some(measured.episode_ms_of(*team)? * f64::from(episodes)));
    let each_s = capacity
        .time
        .max_slot_time_s(episodes, shards, plan.max_faults);
    Load {
        day,
        is_under_way: false,
        teams: count,
        episodes: count.saturating_mul(episodes),
        expected_ms: expected.sum(),
        longest_s: f64::from(count) * each_s,
        deadline: stage
            .deadline(day, cut_at)
            .map(|at| (at, hours(cut_at, at))),
    }
}

fn open_load(
    day: &faceoff_store::Day,
    work: &[EvaluationBacklog],
    capacity: &Capacity,
    now: Timestamp,
) -> Load {
    let day_backlog = || {
        work.iter()
            .filter(|work| work.stage_day == day.stage_day && work.episodes > 0)
    };
    let longest_s = |work: &EvaluationBacklog| {
        capacity
            .time
            .max_slot_time_s(work.episodes, work.shards, work.max_faults)
    };
    Load {
        day: day.stage_day.date,
        is_under_way: true,
        teams: u32::try_from(day_backlog().count()).unwrap_or(u32::MAX),
        episodes: day_backlog().map(|work| work.episodes).sum(),
        expected_ms: day_backlog().map(|work| work.expected_ms).sum(),
        longest_s: day_backlog().map(longest_s).sum(),
        deadline: day.deadline_at.map(|at| (at, hours(now, at).max(0.0))),
    }
}

/// The forecast at the current time.
#[boxed]
pub async fn build(app: &AppState, id: StageId) -> Result<CapacityView, Problem> {
    let now = app.config.clock.now();
    let forecast = forecast(&app.store, &app.config.capacity, id, now);
    Ok(forecast.await?)
}

/// The forecast at `now`.
#[boxed]
pub async fn forecast(
    store: &Store,
    capacity: &Capacity,
    id: StageId,
    now: Timestamp,
) -> Result<CapacityView, StoreError> {
    let stage = store.stage(id).await?;
    let (work, measured) = store.evaluation_backlog(now).await?;
    let under_way = store.unreleased_days(id).await?;
    let mut loads: Vec<Load> = under_way
        .iter()
        .map(|day| open_load(day, &work, capacity, now))
        .collect();
    let newest = store.newest_day(id).await?;
    let season_is_open = store.season().await?.closed_at.is_none();
    let next = stage.next_cutoff(newest.map(|day| day.stage_day.date), now);
    if let Some((day, at)) = next.filter(|_| season_is_open) {
        let mut active = store.active_submissions().await?;
        active.retain(|submission| stage.check_accepts(submission).is_ok());
        let teams: Vec<TeamId> = active.iter().map(|submission| submission.team).collect();
        let cutoff_at = at.unwrap_or(now).max(now);
        loads.push(next_load(
            &stage, day, cutoff_at, &teams, &measured, capacity,
        ));
    }
    let slots = capacity.slots + store.workers().available_slots(now);
    let to_day_load = |load: &Load| day_load(load, slots);
    Ok(CapacityView {
        stage: stage.id,
        stage_name: stage.name.clone(),
        slots,
        days: loads.iter().map(to_day_load).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    fn load(expected_hours: Option<f64>, worst_hours: f64, available: Option<f64>) -> DayLoad {
        let load = Load {
            day: date(2026, 3, 1),
            is_under_way: false,
            teams: 40,
            episodes: 120_000,
            expected_ms: expected_hours.map(|hours| hours * 2.0 * 3.6e6),
            longest_s: worst_hours * 2.0 * 3600.0,
            deadline: available.map(|hours| (Timestamp::UNIX_EPOCH, hours)),
        };
        day_load(&load, 2)
    }

    #[test]
    fn fit_and_summary_follow_from_hours() {
        for (expected, worst, available, fit, words) in [
            (Some(10.0), 20.0, Some(24.0), Fit::Surely, "it fits"),
            (None, 20.0, Some(24.0), Fit::Surely, "it fits"),
            (
                Some(10.0),
                400.0,
                Some(24.0),
                Fit::Probably,
                "probably fits",
            ),
            (Some(30.0), 400.0, Some(24.0), Fit::Not, "does not fit"),
            (None, 400.0, Some(24.0), Fit::Unknown, "duration unknown"),
            (Some(30.0), 400.0, None, Fit::Surely, "No deadline"),
        ] {
            let load = load(expected, worst, available);
            assert_eq!(load.fit, fit, "{}", load.summary);
            assert!(load.summary.contains(words), "{}", load.summary);
            assert!(
                load.summary.contains("40 teams would have 120000 episodes"),
                "{}",
                load.summary
            );
            assert_eq!(load.expected_hours, expected);
            assert!((load.worst_case_hours - worst).abs() < 1e-9);
        }
    }
}
