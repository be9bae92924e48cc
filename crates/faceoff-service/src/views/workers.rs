//! Remote workers: processes on other machines that run jobs of this server. A worker runs one job in each of its *slots*.

use crate::{app::AppState, boxed_future, problem::Problem};
use faceoff_api::views::workers::{
    BusySlotView, WorkerBanView, WorkerState, WorkerView, WorkersView,
};
use faceoff_live::{SlotStatus, WorkerStatus};
use jiff::{SignedDuration, Timestamp};

/// A job that runs longer than this is reported as an alarm.
const ALARM_AFTER: SignedDuration = SignedDuration::from_hours(1);

/// Largest number of evaluations and games that are listed for a banned worker.
const MAX_LISTED: u32 = 100;

/// All workers, with the bans.
#[boxed_future]
pub async fn with_bans(app: &AppState) -> Result<WorkersView, Problem> {
    let mut bans = Vec::new();
    for ban in app.store.worker_bans().await? {
        let worker = ban.worker.parse().map_err(Problem::internal)?;
        let results = app.store.results_of_worker(&worker, MAX_LISTED).await?;
        bans.push(WorkerBanView {
            worker: ban.worker,
            at: ban.at,
            reason: ban.reason,
            evaluations: results.evaluations,
            games: results.games,
        });
    }
    Ok(WorkersView {
        bans,
        ..current(app)
    })
}

/// All workers, without the bans, which need a database read.
pub fn current(app: &AppState) -> WorkersView {
    let (workers, now) = (&app.live.workers, app.config.clock.now());
    let problems = workers.problems().into_iter();
    let problems =
        problems.map(|(operation, error)| format!("The server cannot {operation}: {error}"));
    let all = workers.all();
    let unsent_results = all.iter().flat_map(unsent_results);
    let problems = problems.chain(unsent_results).collect();
    let alarms = all
        .iter()
        .flat_map(|worker| long_jobs(worker, now))
        .collect();
    WorkersView {
        own_slots: app.config.capacity.slots,
        remote_slots: workers.available_slots(now),
        leases_jobs: workers.are_enabled(),
        problems,
        alarms,
        workers: all
            .into_iter()
            .map(|worker| worker_view(worker, now))
            .collect(),
        bans: Vec::new(),
    }
}

/// Descriptions of jobs whose result a worker cannot send.
fn unsent_results(worker: &WorkerStatus) -> impl Iterator<Item = String> {
    worker.busy_slots.iter().filter_map(|(slot, busy)| {
        let problem = busy.problem.as_ref()?;
        let job = describe(worker, slot, busy);
        Some(format!(
            "A worker cannot send the result of a job: {job}: {problem}"
        ))
    })
}

/// Descriptions of jobs that a worker has been running for very long.
fn long_jobs(worker: &WorkerStatus, now: Timestamp) -> impl Iterator<Item = String> {
    worker.busy_slots.iter().filter_map(move |(slot, busy)| {
        let job = describe(worker, slot, busy);
        is_long(busy, now).then(|| format!("A job has been running for more than an hour: {job}"))
    })
}

/// The slot and its job in words.
fn describe(worker: &WorkerStatus, slot: &str, busy: &SlotStatus) -> String {
    let job = busy
        .description
        .as_deref()
        .unwrap_or("started before this server process");
    format!("{}/{slot}, job {} ({job})", worker.name, busy.job)
}

fn is_long(busy: &SlotStatus, now: Timestamp) -> bool {
    now.duration_since(busy.since) > ALARM_AFTER
}

fn worker_view(worker: WorkerStatus, now: Timestamp) -> WorkerView {
    let state = match &worker.refusal {
        _ if !worker.is_online(now) => WorkerState::Silent,
        Some(_) => WorkerState::Refused,
        None if worker.busy_slots.is_empty() => WorkerState::Idle,
        None => WorkerState::Working,
    };
    let busy = worker
        .busy_slots
        .into_iter()
        .map(|(slot, busy)| BusySlotView {
            is_long: is_long(&busy, now),
            slot,
            job: busy.job,
            job_description: busy.description,
            since: busy.since,
            problem: busy.problem,
        });
    WorkerView {
        busy: busy.collect(),
        name: worker.name,
        version: worker.info.version,
        slots: worker.info.slots,
        labels: worker.info.labels,
        first_at: worker.first_seen_at,
        last_at: worker.last_seen_at,
        refused: worker.refusal,
        state,
    }
}
