//! Who works for the server on other machines.

use crate::{app::AppState, problem::Problem};
use faceoff_store::{WorkerBusy, WorkerHeard};
use faceoff_types::{EvaluationId, GameId};
use jiff::{SignedDuration, Timestamp};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

/// A unit that takes longer than this is worth a look.
const LONG: SignedDuration = SignedDuration::from_hours(1);

/// Who plays, and what keeps others from it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkersView {
    /// Slots of the server itself that play; 0 if others do.
    pub own_slots: u32,
    /// Slots elsewhere that can be given work now.
    pub remote_slots: u32,
    /// Is work given to other machines?
    pub is_given: bool,
    /// What the server cannot do for other machines, and why; empty if nothing is missing.
    #[schema(example = json!([]))]
    pub troubles: Vec<String>,
    /// What takes so long that it is worth a look; empty if nothing does.
    #[serde(default)]
    #[schema(example = json!([]))]
    pub alarms: Vec<String>,
    /// By name, as far as this process has heard of them.
    pub workers: Vec<WorkerView>,
    /// Of whom nothing is taken, by name.
    pub bans: Vec<WorkerBanView>,
}

/// A worker of which nothing is taken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerBanView {
    /// What it is called.
    #[schema(example = "rack-1")]
    pub worker: String,
    /// Since when.
    pub at: Timestamp,
    /// Why.
    pub reason: String,
    /// Evaluations that count and of which it has played a part, the newest first, 100 at most: void what is not to be believed.
    #[schema(example = json!([]))]
    pub evaluations: Vec<EvaluationId>,
    /// Games that it has played and whose result counts, the newest first, 100 at most.
    #[schema(example = json!([]))]
    pub games: Vec<GameId>,
}

/// So much is listed of what a worker has played.
const MOST_PLAYED: u32 = 100;

/// A worker on another machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct WorkerView {
    /// What it is called.
    #[schema(example = "rack-1")]
    pub name: String,
    /// The version of its program.
    pub version: String,
    /// Units that it works at at the same time.
    pub slots: u32,
    /// What its owner calls it by beside its name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(example = json!(["lab 3"]))]
    pub labels: Vec<String>,
    /// When the server heard of it first, since it was started.
    pub first_at: Timestamp,
    /// When it did last.
    pub last_at: Timestamp,
    /// How it stands.
    pub state: WorkerState,
    /// Why it gets no work; absent unless it is `refused`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// What its slots do.
    pub busy: Vec<BusyView>,
}

/// How a worker stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WorkerState {
    /// A slot has something to do.
    Working,
    /// None has.
    Idle,
    /// It is not like the server, and gets no work.
    Refused,
    /// Nothing was heard of it for half a minute.
    Silent,
}

/// What a slot does.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct BusyView {
    /// Which slot.
    #[schema(example = "slot-0")]
    pub slot: String,
    /// The unit of work, as the server's log names it.
    pub unit: Uuid,
    /// What it is; absent if it was begun before the server was started.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = "hit episodes 0 to 49")]
    pub what: Option<String>,
    /// Since when.
    pub since: Timestamp,
    /// It takes longer than an hour.
    pub is_long: bool,
    /// What keeps it from handing in what came of it; absent if nothing does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trouble: Option<String>,
}

impl WorkersView {
    pub(crate) async fn with_bans(app: &AppState) -> Result<Self, Problem> {
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
        Ok(Self {
            bans,
            ..Self::now(app)
        })
    }

    /// As far as it is known without asking the database: nothing of bans.
    pub(crate) fn now(app: &AppState) -> Self {
        let (workers, now) = (app.store.workers(), app.config.clock.now());
        let troubles = workers.troubles().into_iter();
        let troubles = troubles.map(|(what, why)| format!("The server cannot {what}: {why}"));
        let all = workers.all();
        let stuck = all.iter().flat_map(stuck);
        let troubles = troubles.chain(stuck).collect();
        let alarms = all.iter().flat_map(|worker| long(worker, now)).collect();
        Self {
            own_slots: app.config.capacity.slots,
            remote_slots: workers.slots(now),
            is_given: workers.are_used(),
            troubles,
            alarms,
            workers: all
                .into_iter()
                .map(|worker| WorkerView::of(worker, now))
                .collect(),
            bans: Vec::new(),
        }
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

impl WorkerView {
    fn of(worker: WorkerHeard, now: Timestamp) -> Self {
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
        Self {
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
}
