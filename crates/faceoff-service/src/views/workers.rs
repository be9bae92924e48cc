//! Who works for the server on other machines.

use crate::{app::AppState, boxed, problem::Problem};
use faceoff_api::views::workers::{BusyView, WorkerBanView, WorkerState, WorkerView, WorkersView};
use faceoff_store::{WorkerBusy, WorkerHeard};
use jiff::{SignedDuration, Timestamp};

/// A unit that takes longer than this is worth a look.
const LONG: SignedDuration = SignedDuration::from_hours(1);

/// So much is listed of what a worker has played.
const MOST_PLAYED: u32 = 100;

/// All that is known, with the bans.
#[boxed]
pub async fn with_bans(app: &AppState) -> Result<WorkersView, Problem> {
    let mut bans = Vec::new();
    for ban in app.store.worker_bans().await? {
        let worker = ban.worker.parse().map_err(Problem::internal)?;
        let played = app.store.played_by(&worker, MOST_PLAYED).await?;
        bans.push(WorkerBanView {
            worker: ban.worker,
            at: ban.at,
            reason: ban.reason,
            evaluations: played.evaluations,
            games: played.games,
        });
    }
    Ok(WorkersView { bans, ..now(app) })
}

/// As far as it is known without asking the database: nothing of bans.
pub fn now(app: &AppState) -> WorkersView {
    let (workers, now) = (app.store.workers(), app.config.clock.now());
    let troubles = workers.troubles().into_iter();
    let troubles = troubles.map(|(what, why)| format!("The server cannot {what}: {why}"));
    let all = workers.all();
    let stuck = all.iter().flat_map(stuck);
    let troubles = troubles.chain(stuck).collect();
    let alarms = all.iter().flat_map(|worker| long(worker, now)).collect();
    WorkersView {
        own_slots: app.config.capacity.slots,
        remote_slots: workers.slots(now),
        is_given: workers.are_used(),
        troubles,
        alarms,
        workers: all.into_iter().map(|heard| worker(heard, now)).collect(),
        bans: Vec::new(),
    }
}

/// What a worker has played and cannot hand in.
fn stuck(worker: &WorkerHeard) -> impl Iterator<Item = String> {
    worker.busy.iter().filter_map(|(slot, busy)| {
        let trouble = busy.trouble.as_ref()?;
        let what = named(worker, slot, busy);
        Some(format!(
            "A worker cannot hand in what it has played: {what}: {trouble}"
        ))
    })
}

/// What a worker has worked at for very long.
fn long(worker: &WorkerHeard, now: Timestamp) -> impl Iterator<Item = String> {
    worker.busy.iter().filter_map(move |(slot, busy)| {
        let what = named(worker, slot, busy);
        is_long(busy, now).then(|| format!("A worker takes more than an hour: {what}"))
    })
}

fn named(worker: &WorkerHeard, slot: &str, busy: &WorkerBusy) -> String {
    let what = busy.what.as_deref().unwrap_or("begun before this server");
    format!("{}/{slot}, unit {} ({what})", worker.name, busy.unit)
}

fn is_long(busy: &WorkerBusy, now: Timestamp) -> bool {
    now.duration_since(busy.since) > LONG
}

fn worker(worker: WorkerHeard, now: Timestamp) -> WorkerView {
    let state = match &worker.refused {
        _ if !worker.is_there(now) => WorkerState::Silent,
        Some(_) => WorkerState::Refused,
        None if worker.busy.is_empty() => WorkerState::Idle,
        None => WorkerState::Working,
    };
    let busy = worker.busy.into_iter().map(|(slot, busy)| BusyView {
        is_long: is_long(&busy, now),
        slot,
        unit: busy.unit,
        what: busy.what,
        since: busy.since,
        trouble: busy.trouble,
    });
    WorkerView {
        busy: busy.collect(),
        name: worker.name,
        version: worker.about.version,
        slots: worker.about.slots,
        labels: worker.about.labels,
        first_at: worker.first_at,
        last_at: worker.last_at,
        refused: worker.refused,
        state,
    }
}
