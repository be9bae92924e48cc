//! Capacity forecast: whether the evaluations of a day can finish before its deadline. A *slot* runs one job at a time; a job of an
//! evaluation is a *shard*, a part of its episodes.

use crate::{app::AppState, boxed_future, config::Capacity, problem::Problem};
use faceoff_api::views::capacity::{CapacityView, DayLoad, Fit};
use faceoff_live::Workers;
use faceoff_store::{EvaluationBacklog, JobDurations, Stage, Store, StoreError};
use faceoff_types::{StageId, TeamId};
use jiff::{Timestamp, civil::Date};

/// Remaining work of a day, independent of the number of slots.
struct Load {
    day: Date,
    /// Whether the day's cutoff has passed.
    is_under_way: bool,
    /// Number of teams with remaining episodes.
    teams: u32,
    /// Number of remaining episodes of all teams.
    episodes: u32,
    /// Expected duration on one slot, from measured durations.
    expected_ms: Option<f64>,
    /// Duration on one slot if every agent uses up its time limits.
    longest_s: f64,
    /// The deadline, and the hours until then: from now or, before the day's cutoff, from the cutoff.
    deadline: Option<(Timestamp, f64)>,
}

fn hours_between(start: Timestamp, end: Timestamp) -> f64 {
    end.duration_since(start).as_secs_f64() / 3600.0
}

/// The forecast of a day: whether its load fits into these slots.
fn day_forecast(load: &Load, slots: u32) -> DayLoad {
    let slots = f64::from(slots.max(1));
    let worst_case_hours = load.longest_s / slots / 3600.0;
    let expected_hours = load.expected_ms.map(|ms| ms / 1000.0 / slots / 3600.0);
    let available_hours = load.deadline.map(|(_, hours)| hours);
    let fit = match (available_hours, expected_hours) {
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
        hours_until_deadline: available_hours,
        fit,
        summary: String::new(),
    };
    view.summary = summary(&view);
    view
}

/// The forecast of a day in words.
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
        (false, 1) => "1 team will have".to_owned(),
        (false, teams) => format!("{teams} teams will have"),
    };
    let expected = match day.expected_hours {
        Some(hours) => format!("{hours:.1} hours expected, as measured in the last seven days"),
        None => "Duration unknown (nothing measured in the last seven days)".to_owned(),
    };
    let load = format!(
        "{}: {teams} {} episodes to run. {expected}; at most {:.1} hours, if every agent uses up its time",
        day.day, day.episodes, day.worst_case_hours
    );
    let Some(available_hours) = day.hours_until_deadline else {
        return format!("{load}. No deadline.");
    };
    let advice = "More slots, fewer episodes or a later deadline (day_deadline) would help";
    match day.fit {
        Fit::Surely => format!("{load}. The day has {available_hours:.1} hours: it fits."),
        Fit::Probably => format!(
            "{load}. The day has {available_hours:.1} hours: it probably fits, unless agents use up their time."
        ),
        Fit::Unknown => format!(
            "{load}. The day has {available_hours:.1} hours: evaluations of slow agents may not finish. {advice}."
        ),
        Fit::Not => format!(
            "{load}. The day has {available_hours:.1} hours: it does not fit. Evaluations that are not finished at the deadline \
             will not count. {advice}."
        ),
    }
}

/// Load of the day of the next cutoff, if the submissions that are active now stay active.
fn next_day_load(
    stage: &Stage,
    day: Date,
    cutoff_at: Timestamp,
    teams: &[TeamId],
    durations: &JobDurations,
    capacity: &Capacity,
) -> Load {
    let plan = stage.plan();
    let episodes = plan.episodes_total();
    let tasks = u32::try_from(plan.tasks.len()).unwrap_or(u32::MAX);
    let shards = tasks.saturating_mul(
        plan.episodes_per_task
            .div_ceil(plan.episodes_per_shard.max(1)),
    );
    let team_count = u32::try_from(teams.len()).unwrap_or(u32::MAX);
    let expected = teams
        .iter()
        .map(|team| Some(durations.episode_ms_of(*team)? * f64::from(episodes)));
    let longest_per_team_s = capacity.time.max_slot_time_s(
        capacity.longest_episode_s,
        episodes,
        shards,
        plan.max_faults,
    );
    Load {
        day,
        is_under_way: false,
        teams: team_count,
        episodes: team_count.saturating_mul(episodes),
        expected_ms: expected.sum(),
        longest_s: f64::from(team_count) * longest_per_team_s,
        deadline: stage
            .deadline(day, cutoff_at)
            .map(|at| (at, hours_between(cutoff_at, at))),
    }
}

/// Remaining load of a day that is under way.
fn running_day_load(
    day: &faceoff_store::Day,
    backlog: &[EvaluationBacklog],
    capacity: &Capacity,
    now: Timestamp,
) -> Load {
    let day_backlog = || {
        backlog
            .iter()
            .filter(|entry| entry.stage_day == day.stage_day && entry.episodes > 0)
    };
    let longest_s = |entry: &EvaluationBacklog| {
        capacity.time.max_slot_time_s(
            capacity.longest_episode_s,
            entry.episodes,
            entry.shards,
            entry.max_faults,
        )
    };
    Load {
        day: day.stage_day.date,
        is_under_way: true,
        teams: u32::try_from(day_backlog().count()).unwrap_or(u32::MAX),
        episodes: day_backlog().map(|entry| entry.episodes).sum(),
        expected_ms: day_backlog().map(|entry| entry.expected_ms).sum(),
        longest_s: day_backlog().map(longest_s).sum(),
        deadline: day
            .deadline_at
            .map(|at| (at, hours_between(now, at).max(0.0))),
    }
}

/// The forecast at the current time.
#[boxed_future]
pub async fn build(app: &AppState, id: StageId) -> Result<CapacityView, Problem> {
    let now = app.config.clock.now();
    let forecast = forecast(&app.store, &app.live.workers, &app.config.capacity, id, now);
    Ok(forecast.await?)
}

/// The forecast at `now`.
#[boxed_future]
pub async fn forecast(
    store: &Store,
    workers: &Workers,
    capacity: &Capacity,
    id: StageId,
    now: Timestamp,
) -> Result<CapacityView, StoreError> {
    let stage = store.stage(id).await?;
    let (backlog, durations) = store.evaluation_backlog(now).await?;
    let running_days = store.unreleased_days(id).await?;
    let mut loads: Vec<Load> = running_days
        .iter()
        .map(|day| running_day_load(day, &backlog, capacity, now))
        .collect();
    let season_is_open = store.season().await?.closed_at.is_none();
    let next = store.next_cutoff(&stage, now).await?;
    if let Some((day, at)) = next.filter(|_| season_is_open) {
        let mut active = store.active_submissions().await?;
        active.retain(|submission| stage.check_accepts(submission).is_ok());
        let teams: Vec<TeamId> = active.iter().map(|submission| submission.team).collect();
        // Without a schedule, or if its cutoff is due, the day could start now.
        let cutoff_at = at.unwrap_or(now).max(now);
        loads.push(next_day_load(
            &stage, day, cutoff_at, &teams, &durations, capacity,
        ));
    }
    let slots = capacity.slots + workers.available_slots(now);
    let to_forecast = |load: &Load| day_forecast(load, slots);
    Ok(CapacityView {
        stage: stage.id,
        stage_name: stage.name.clone(),
        slots,
        days: loads.iter().map(to_forecast).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    /// The forecast of a day of 40 teams on two slots, with these durations.
    fn forecast_day(
        expected_hours: Option<f64>,
        worst_hours: f64,
        available_hours: Option<f64>,
    ) -> DayLoad {
        const SLOTS: u32 = 2;
        let load = Load {
            day: date(2026, 3, 1),
            is_under_way: false,
            teams: 40,
            episodes: 120_000,
            expected_ms: expected_hours.map(|hours| hours * f64::from(SLOTS) * 3.6e6),
            longest_s: worst_hours * f64::from(SLOTS) * 3600.0,
            deadline: available_hours.map(|hours| (Timestamp::UNIX_EPOCH, hours)),
        };
        day_forecast(&load, SLOTS)
    }

    #[test]
    fn forecast_and_its_text_follow_from_hours() {
        for (expected_hours, worst_hours, available_hours, fit, phrase) in [
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
            (None, 400.0, Some(24.0), Fit::Unknown, "Duration unknown"),
            (Some(30.0), 400.0, None, Fit::Surely, "No deadline"),
        ] {
            let load = forecast_day(expected_hours, worst_hours, available_hours);
            assert_eq!(load.fit, fit, "{}", load.summary);
            assert!(load.summary.contains(phrase), "{}", load.summary);
            assert!(
                load.summary.contains("40 teams will have 120000 episodes"),
                "{}",
                load.summary
            );
            assert_eq!(load.expected_hours, expected_hours);
            assert!((load.worst_case_hours - worst_hours).abs() < 1e-9);
        }
    }
}
