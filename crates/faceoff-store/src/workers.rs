//! Workers on other machines, as far as this process has heard of them: in memory alone, since whose work is stands in the queue.

use jiff::{SignedDuration, Timestamp};
use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    fmt,
    str::FromStr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use uuid::Uuid;

/// Nothing was heard of a worker for so long: it has gone, or is cut off. A slot that has nothing to do asks every few seconds.
pub const WORKER_SILENT: SignedDuration = SignedDuration::from_secs(30);
/// After this it is forgotten.
const FORGOTTEN: SignedDuration = SignedDuration::from_hours(24);
/// So many are remembered at most.
const MOST: usize = 10_000;

/// What the holders of leases elsewhere begin with.
const ELSEWHERE: &str = "remote/";

/// How long a worker's name may be.
const LONGEST_NAME: usize = 64;

/// What a worker elsewhere is called: 1 to 64 of a-z, A-Z, 0-9, - and _, so that it can be a token of a subject of NATS.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct WorkerName(String);

/// A text that is no [`WorkerName`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected a worker's name: 1 to {LONGEST_NAME} of a-z, A-Z, 0-9, - and _")]
pub struct NoWorkerName;

impl WorkerName {
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The worker whose slot holds a lease, if one elsewhere does.
    #[must_use]
    pub fn of_holder(holder: &str) -> Option<Self> {
        let (worker, _) = holder.strip_prefix(ELSEWHERE)?.split_once('/')?;
        worker.parse().ok()
    }

    /// What its leases name, and below it its slots.
    #[must_use]
    pub fn holder(&self) -> String {
        format!("{ELSEWHERE}{}", self.0)
    }
}

impl fmt::Display for WorkerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for WorkerName {
    type Err = NoWorkerName;

    fn from_str(text: &str) -> Result<Self, NoWorkerName> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let is_name = (1..=LONGEST_NAME).contains(&text.len()) && text.chars().all(allowed);
        is_name.then(|| Self(text.to_owned())).ok_or(NoWorkerName)
    }
}

/// What is known of workers elsewhere. Cloning is cheap.
#[derive(Debug, Clone, Default)]
pub struct Workers(Arc<Mutex<Known>>);

#[derive(Debug, Default)]
struct Known {
    workers: BTreeMap<String, WorkerHeard>,
    /// By what it keeps the server from.
    troubles: BTreeMap<String, String>,
    /// By the names of those of whom nothing is taken: why.
    banned: BTreeMap<String, String>,
    /// Orders whose files are being stored, or must not change any more, by their nonces.
    files: HashMap<Uuid, Files>,
    /// Workers that gave back what they could not play, by name.
    failing: HashMap<String, Failing>,
    is_used: bool,
}

/// A worker whose units fail one after the other, as it is remembered.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Failing {
    /// Units in a row that it could not play; one that nobody can play is one, however often it comes back.
    units: BTreeSet<Uuid>,
    /// It gets nothing before this.
    until: Option<Timestamp>,
}

/// After so many units in a row that a worker could not play it gets none for a while …
const FAILS_IN_A_ROW: usize = 3;
/// … and twice as long each time that it fails again, up to an hour.
const RESTS: SignedDuration = SignedDuration::from_mins(1);
const RESTS_AT_MOST: SignedDuration = SignedDuration::from_hours(1);

/// How the files of an order stand.
#[derive(Debug, Default)]
struct Files {
    being_stored: u32,
    are_closed: bool,
}

/// A file of an order is being stored until this is dropped.
#[derive(Debug)]
pub struct Storing {
    nonce: Uuid,
    workers: Workers,
}

impl Drop for Storing {
    fn drop(&mut self) {
        let mut known = self.workers.known();
        if let Some(files) = known.files.get_mut(&self.nonce) {
            files.being_stored = files.being_stored.saturating_sub(1);
            if files.being_stored == 0 && !files.are_closed {
                known.files.remove(&self.nonce);
            }
        }
    }
}

/// What a worker says of itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WorkerAbout {
    /// The version of its program.
    pub version: String,
    /// Units that it works at at the same time.
    pub slots: u32,
    /// What its owner calls it by beside its name.
    pub labels: Vec<String>,
}

/// A worker, as it was heard of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerHeard {
    /// What it is called.
    pub name: String,
    /// What it says of itself.
    pub about: WorkerAbout,
    /// When this process heard of it first.
    pub first_at: Timestamp,
    /// When it did last.
    pub last_at: Timestamp,
    /// Why it gets no work, if it gets none.
    pub refused: Option<String>,
    /// What its slots do, by their names; those that do nothing are not here.
    pub busy: BTreeMap<String, WorkerBusy>,
}

/// What a slot elsewhere does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerBusy {
    pub unit: Uuid,
    /// What it is, in words; none if it was begun before this process.
    pub what: Option<String>,
    /// Since when, as far as this process knows.
    pub since: Timestamp,
    /// What keeps the slot from handing in what came of it.
    pub trouble: Option<String>,
}

/// What is told of a unit that is worked at.
#[derive(Debug, Clone, Copy, Default)]
pub struct WorkTold<'a> {
    /// What it is, in words, if that is known.
    pub what: Option<&'a str>,
    /// What keeps the slot from handing in what came of it.
    pub trouble: Option<&'a str>,
}

impl WorkerHeard {
    fn first(name: &str, now: Timestamp) -> Self {
        Self {
            name: name.to_owned(),
            about: WorkerAbout::default(),
            first_at: now,
            last_at: now,
            refused: None,
            busy: BTreeMap::new(),
        }
    }

    /// Units that it can work at, as far as is known: it may not have said so yet.
    fn slots(&self) -> u32 {
        let busy = u32::try_from(self.busy.len()).unwrap_or(u32::MAX);
        self.about.slots.max(busy)
    }

    /// Was it heard of a moment ago?
    #[must_use]
    pub fn is_there(&self, now: Timestamp) -> bool {
        now.duration_since(self.last_at) < WORKER_SILENT
    }
}

impl Workers {
    /// Work is given to other machines.
    pub fn use_them(&self) {
        self.known().is_used = true;
    }

    /// Is work given to other machines?
    #[must_use]
    pub fn are_used(&self) -> bool {
        self.known().is_used
    }

    /// A worker asks for work.
    pub fn heard(&self, name: &str, about: WorkerAbout, refused: Option<&str>, now: Timestamp) {
        let mut known = self.known();
        known
            .workers
            .retain(|_, worker| now.duration_since(worker.last_at) < FORGOTTEN);
        let is_full = known.workers.len() >= MOST;
        let worker = match known.workers.get_mut(name) {
            Some(worker) => worker,
            None if is_full => return,
            None => {
                let worker = known.workers.entry(name.to_owned());
                worker.or_insert_with(|| WorkerHeard::first(name, now))
            }
        };
        worker.about = about;
        worker.refused = refused.map(str::to_owned);
        worker.last_at = now;
    }

    /// One of its slots works at a unit, which the queue says, too. `trouble`: what keeps it from handing in what came of it. One that began
    /// before this process is heard of by this first.
    pub fn works(&self, name: &str, slot: &str, unit: Uuid, told: WorkTold<'_>, now: Timestamp) {
        let mut known = self.known();
        if !known.workers.contains_key(name) && known.workers.len() >= MOST {
            return;
        }
        let worker = known.workers.entry(name.to_owned());
        let worker = worker.or_insert_with(|| WorkerHeard::first(name, now));
        worker.last_at = now;
        let begun = WorkerBusy {
            unit,
            what: told.what.map(str::to_owned),
            since: now,
            trouble: None,
        };
        let busy = worker.busy.entry(slot.to_owned()).or_insert(begun.clone());
        if busy.unit != unit {
            *busy = begun;
        }
        busy.trouble = told.trouble.map(str::to_owned);
    }

    /// A unit came back that a worker could not play, by no fault of the agent's; how many in a row, and until when it gets nothing.
    pub fn failed(&self, name: &str, unit: Uuid, now: Timestamp) -> Option<(usize, Timestamp)> {
        let mut known = self.known();
        if !known.failing.contains_key(name) && known.failing.len() >= MOST {
            return None;
        }
        let failing = known.failing.entry(name.to_owned()).or_default();
        if !failing.units.insert(unit) {
            return None;
        }
        let units = failing.units.len();
        let more = units.checked_sub(FAILS_IN_A_ROW)?;
        let doubled = i32::try_from(more.min(6)).unwrap_or_default();
        let rests = (RESTS * 2_i32.pow(doubled.unsigned_abs())).min(RESTS_AT_MOST);
        let until = now.saturating_add(rests).unwrap_or(Timestamp::MAX);
        failing.until = Some(until);
        Some((units, until))
    }

    /// A worker has played a unit.
    pub fn played(&self, name: &str) {
        self.known().failing.remove(name);
    }

    /// Why a worker whose units fail gets nothing now, if so.
    #[must_use]
    pub fn rests(&self, name: &str, now: Timestamp) -> Option<String> {
        let known = self.known();
        let failing = known.failing.get(name)?;
        let until = failing.until.filter(|until| *until > now)?;
        Some(format!(
            "it could not play the last {} units that it was given, and gets none before {}: look into its log, and run `faceoff doctor` there",
            failing.units.len(),
            until.strftime("%Y-%m-%d %H:%M:%S UTC")
        ))
    }

    /// Whoever works at a unit does so no more.
    pub fn ended(&self, unit: Uuid) {
        for worker in self.known().workers.values_mut() {
            worker.busy.retain(|_, busy| busy.unit != unit);
        }
    }

    /// All of them, by name.
    #[must_use]
    pub fn all(&self) -> Vec<WorkerHeard> {
        self.known().workers.values().cloned().collect()
    }

    /// Slots elsewhere that can be given work now.
    #[must_use]
    pub fn slots(&self, now: Timestamp) -> u32 {
        let known = self.known();
        let work = known
            .workers
            .values()
            .filter(|worker| worker.refused.is_none() && worker.is_there(now));
        work.map(WorkerHeard::slots).sum()
    }

    /// What keeps the server from `what`; none: nothing any more.
    pub fn trouble(&self, what: &str, cause: Option<&str>) {
        let mut known = self.known();
        match cause {
            Some(cause) => drop(known.troubles.insert(what.to_owned(), cause.to_owned())),
            None => drop(known.troubles.remove(what)),
        }
    }

    /// Does something keep the server from `what`?
    #[must_use]
    pub fn is_troubled(&self, what: &str) -> bool {
        self.known().troubles.contains_key(what)
    }

    /// What the server cannot do for other machines, and why.
    #[must_use]
    pub fn troubles(&self) -> Vec<(String, String)> {
        let known = self.known();
        let troubles = known.troubles.iter();
        troubles
            .map(|(what, why)| (what.clone(), why.clone()))
            .collect()
    }

    /// Nothing is taken of these workers, and why; all others are taken.
    pub fn set_banned(&self, banned: impl IntoIterator<Item = (String, String)>) {
        self.known().banned = banned.into_iter().collect();
    }

    pub(crate) fn ban(&self, worker: &str, reason: &str) {
        let mut known = self.known();
        known.banned.insert(worker.to_owned(), reason.to_owned());
        if let Some(worker) = known.workers.get_mut(worker) {
            worker.busy.clear();
        }
    }

    pub(crate) fn readmit(&self, worker: &str) {
        self.known().banned.remove(worker);
    }

    /// Why nothing is taken of a worker, if so.
    #[must_use]
    pub fn ban_of(&self, worker: &str) -> Option<String> {
        self.known().banned.get(worker).cloned()
    }

    /// A file of the order of this nonce is being stored; `None` if its files are closed.
    #[must_use]
    pub fn storing(&self, nonce: Uuid) -> Option<Storing> {
        let mut known = self.known();
        let files = known.files.entry(nonce).or_default();
        if files.are_closed {
            return None;
        }
        files.being_stored += 1;
        let workers = self.clone();
        Some(Storing { nonce, workers })
    }

    /// From now on the files of this order stay what they are; false while one is still being stored.
    #[must_use]
    pub fn close_files(&self, nonce: Uuid) -> bool {
        let mut known = self.known();
        let files = known.files.entry(nonce).or_default();
        files.are_closed = true;
        files.being_stored == 0
    }

    /// Nothing of this order can be stored any more, whoever asks.
    pub fn forget_files(&self, nonce: Uuid) {
        self.known().files.remove(&nonce);
    }

    /// What is known is whole whatever panicked beside it.
    fn known(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workers_count_while_they_are_heard_of_and_get_work() {
        let workers = Workers::default();
        let about = |slots| WorkerAbout {
            version: "1.0".to_owned(),
            slots,
            labels: Vec::new(),
        };
        let start: Timestamp = "2026-03-01T10:00:00Z".parse().expect("an instant");
        let at = |s: i64| start + SignedDuration::from_secs(s);
        workers.heard("a", about(4), None, at(0));
        workers.heard("b", about(2), Some("it is another program"), at(0));
        assert_eq!(workers.slots(at(29)), 4);
        assert_eq!(workers.slots(at(30)), 0, "it is silent");
        let unit = Uuid::from_u128(1);
        let hit = WorkTold {
            what: Some("hit"),
            trouble: None,
        };
        let stuck = WorkTold {
            what: None,
            trouble: Some("no room"),
        };
        workers.works("a", "slot-0", unit, hit, at(40));
        workers.works("a", "slot-0", unit, stuck, at(50));
        let all = workers.all();
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].first_at, all[0].last_at), (at(0), at(50)));
        let busy = &all[0].busy["slot-0"];
        assert_eq!((busy.what.as_deref(), busy.since), (Some("hit"), at(40)));
        assert_eq!(busy.trouble.as_deref(), Some("no room"));
        workers.works("a", "slot-0", unit, WorkTold::default(), at(50));
        assert_eq!(workers.all()[0].busy["slot-0"].trouble, None);
        // One that works since before this process counts as what it is seen to do.
        workers.works("earlier", "slot-3", Uuid::from_u128(2), hit, at(50));
        assert_eq!(workers.slots(at(50)), 5);
        workers.ended(Uuid::from_u128(2));
        workers.ended(unit);
        assert!(workers.all()[0].busy.is_empty());
        // A day later it is as if it had never been.
        workers.heard("c", about(1), None, at(50) + FORGOTTEN);
        assert_eq!(workers.all().len(), 1);

        workers.trouble("give out work", Some("NATS is away"));
        assert_eq!(workers.troubles().len(), 1);
        workers.trouble("give out work", None);
        assert!(workers.troubles().is_empty());
    }

    #[test]
    fn who_can_play_nothing_rests_longer_each_time_until_it_plays() {
        let workers = Workers::default();
        let start: Timestamp = "2026-03-01T10:00:00Z".parse().expect("an instant");
        let at = |s: i64| start + SignedDuration::from_secs(s);
        let failed = |unit, s| workers.failed("a", Uuid::from_u128(unit), at(s));
        assert_eq!(failed(1, 0), None);
        assert_eq!(failed(1, 0), None);
        assert_eq!(failed(1, 0), None, "one that nobody can play is one");
        assert_eq!(failed(2, 0), None);
        assert_eq!(workers.rests("a", at(0)), None);
        assert_eq!(failed(3, 0), Some((3, at(60))));
        let told = workers.rests("a", at(59)).expect("it rests");
        assert!(told.contains("the last 3 units"), "{told}");
        assert_eq!(workers.rests("a", at(60)), None, "it may try again");
        assert_eq!(failed(4, 60), Some((4, at(180))));
        for unit in 5..25 {
            failed(unit, 180);
        }
        assert_eq!(failed(25, 180), Some((25, at(180 + 3600))));
        assert_eq!(workers.rests("b", at(180)), None);
        workers.played("a");
        assert_eq!(workers.rests("a", at(180)), None);
        assert_eq!(failed(26, 180), None);
    }

    #[test]
    fn files_of_an_order_are_closed_once_nobody_stores_one() {
        let (workers, nonce) = (Workers::default(), Uuid::from_u128(1));
        let first = workers.storing(nonce).expect("open");
        assert!(!workers.close_files(nonce), "one is being stored");
        assert!(workers.storing(nonce).is_none(), "no other is begun");
        drop(first);
        assert!(workers.close_files(nonce));
        assert!(workers.storing(nonce).is_none());
        workers.forget_files(nonce);
        drop(workers.storing(nonce).expect("another life"));
        assert!(workers.known().files.is_empty(), "nothing is left of it");
    }
}
