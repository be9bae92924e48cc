//! Remote workers (on other machines) that have contacted this process: their state, failures and uploads.

use jiff::{SignedDuration, Timestamp};
use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use uuid::Uuid;

/// A worker that has not contacted the server for this time is offline or disconnected. Idle slots poll every few seconds.
pub const WORKER_TIMEOUT: SignedDuration = SignedDuration::from_secs(30);
/// A worker that has not contacted the server for this time is forgotten.
const FORGET_AFTER: SignedDuration = SignedDuration::from_hours(24);
/// Maximum number of workers in memory.
const MAX_WORKERS: usize = 10_000;

/// The remote workers that this process knows. Cloning is cheap.
#[derive(Debug, Clone, Default)]
pub struct Workers(Arc<Mutex<WorkersState>>);

#[derive(Debug, Default)]
struct WorkersState {
    workers: BTreeMap<String, WorkerStatus>,
    /// Operations that the server cannot do for remote workers, such as “publish jobs”, with the causes.
    problems: BTreeMap<String, String>,
    /// Files of leased jobs that are being uploaded or are closed, by the nonce (unique number) of the lease.
    files: HashMap<Uuid, JobFiles>,
    /// Failures in a row, by worker; none after a success.
    failing: HashMap<String, Failures>,
    /// True if this process gives jobs to remote workers.
    are_enabled: bool,
}

/// Failures in a row of a worker.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Failures {
    /// Jobs that it failed to run; a job that fails repeatedly counts once.
    jobs: BTreeSet<Uuid>,
    /// End of its back-off: before this time it gets no job.
    backoff_until: Option<Timestamp>,
}

/// After this number of failed jobs in a row a worker backs off: it gets no jobs for a time.
const MAX_FAILURES: usize = 3;
/// The first back-off, which doubles with each further failure up to [`MAX_BACKOFF`].
const BACKOFF: SignedDuration = SignedDuration::from_mins(1);
const MAX_BACKOFF: SignedDuration = SignedDuration::from_hours(1);
/// After this number of doublings the back-off exceeds its maximum.
const DOUBLINGS_TO_MAX: usize = 6;

/// State of the files of a leased job.
#[derive(Debug, Default)]
struct JobFiles {
    /// Number of running uploads.
    uploads: u32,
    /// True once no upload can begin any more.
    are_closed: bool,
}

/// Guard of the upload of a job's file, which ends when the guard is dropped.
#[derive(Debug)]
pub struct UploadGuard {
    nonce: Uuid,
    workers: Workers,
}

impl Drop for UploadGuard {
    fn drop(&mut self) {
        let mut state = self.workers.lock();
        if let Some(files) = state.files.get_mut(&self.nonce) {
            files.uploads = files.uploads.saturating_sub(1);
            if files.uploads == 0 && !files.are_closed {
                state.files.remove(&self.nonce);
            }
        }
    }
}

/// A worker's information about itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WorkerInfo {
    /// Version of its program.
    pub version: String,
    /// Number of jobs that it runs at the same time.
    pub slots: u32,
    /// Labels set by its operator.
    pub labels: Vec<String>,
}

/// State of a remote worker, as it last reported it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkerStatus {
    pub name: String,
    pub info: WorkerInfo,
    /// When it first contacted this process.
    pub first_seen_at: Timestamp,
    /// When it last contacted this process.
    pub last_seen_at: Timestamp,
    /// Why the server gives it no jobs, such as another version of the program; `None` if it gets jobs.
    pub refusal: Option<String>,
    /// The slots that run a job, by name.
    pub busy_slots: BTreeMap<String, SlotStatus>,
}

/// State of a busy slot of a remote worker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlotStatus {
    pub job: Uuid,
    /// Description of the job for people; `None` if it was claimed before this process started.
    pub description: Option<String>,
    /// When the slot first reported the job to this process.
    pub since: Timestamp,
    /// What prevents the slot from sending its result.
    pub problem: Option<String>,
}

/// A slot's report about its running job.
#[derive(Debug, Clone, Copy, Default)]
pub struct SlotReport<'a> {
    /// Description of the job for people, if it is known.
    pub description: Option<&'a str>,
    /// What prevents the slot from sending its result.
    pub problem: Option<&'a str>,
}

impl WorkerStatus {
    fn new(name: &str, now: Timestamp) -> Self {
        Self {
            name: name.to_owned(),
            info: WorkerInfo::default(),
            first_seen_at: now,
            last_seen_at: now,
            refusal: None,
            busy_slots: BTreeMap::new(),
        }
    }

    /// Number of its slots; at least that of the busy ones, because it may not have reported the number yet.
    fn slots(&self) -> u32 {
        let busy = u32::try_from(self.busy_slots.len()).unwrap_or(u32::MAX);
        self.info.slots.max(busy)
    }

    /// Has the worker contacted the server within [`WORKER_TIMEOUT`]?
    #[must_use]
    pub fn is_online(&self, now: Timestamp) -> bool {
        // The absolute value, since the clock may have been set back.
        now.duration_since(self.last_seen_at).abs() < WORKER_TIMEOUT
    }
}

impl Workers {
    /// Records that this process gives jobs to remote workers.
    pub fn enable(&self) {
        self.lock().are_enabled = true;
    }

    /// Does this process give jobs to remote workers?
    #[must_use]
    pub fn are_enabled(&self) -> bool {
        self.lock().are_enabled
    }

    /// Records that a worker has polled for a job, and why it gets none, if it is refused.
    pub fn record_poll(&self, name: &str, info: WorkerInfo, refusal: Option<&str>, now: Timestamp) {
        let mut state = self.lock();
        state
            .workers
            .retain(|_, worker| now.duration_since(worker.last_seen_at) < FORGET_AFTER);
        let is_full = state.workers.len() >= MAX_WORKERS;
        let worker = match state.workers.get_mut(name) {
            Some(worker) => worker,
            None if is_full => return,
            None => {
                let worker = state.workers.entry(name.to_owned());
                worker.or_insert_with(|| WorkerStatus::new(name, now))
            }
        };
        worker.info = info;
        worker.refusal = refusal.map(str::to_owned);
        worker.last_seen_at = now;
    }

    /// Records that a slot runs a job that is leased to it. A worker that started before this process is added.
    pub fn record_job(
        &self,
        name: &str,
        slot: &str,
        job: Uuid,
        report: SlotReport<'_>,
        now: Timestamp,
    ) {
        let mut state = self.lock();
        if !state.workers.contains_key(name) && state.workers.len() >= MAX_WORKERS {
            return;
        }
        let worker = state.workers.entry(name.to_owned());
        let worker = worker.or_insert_with(|| WorkerStatus::new(name, now));
        worker.last_seen_at = now;
        let new_status = SlotStatus {
            job,
            description: report.description.map(str::to_owned),
            since: now,
            problem: None,
        };
        let busy = worker
            .busy_slots
            .entry(slot.to_owned())
            .or_insert(new_status.clone());
        if busy.job != job {
            *busy = new_status;
        }
        busy.problem = report.problem.map(str::to_owned);
    }

    /// Records that a worker failed to run a job by a platform fault. Returns the number of failures in a row and the end
    /// of the back-off, if this failure starts or extends one.
    pub fn record_failure(
        &self,
        name: &str,
        job: Uuid,
        now: Timestamp,
    ) -> Option<(usize, Timestamp)> {
        let mut state = self.lock();
        if !state.failing.contains_key(name) && state.failing.len() >= MAX_WORKERS {
            return None;
        }
        let failures = state.failing.entry(name.to_owned()).or_default();
        if !failures.jobs.insert(job) {
            return None;
        }
        let count = failures.jobs.len();
        let failures_beyond_first_backoff = count.checked_sub(MAX_FAILURES)?;
        let doublings =
            i32::try_from(failures_beyond_first_backoff.min(DOUBLINGS_TO_MAX)).unwrap_or_default();
        let backoff = (BACKOFF * 2_i32.pow(doublings.unsigned_abs())).min(MAX_BACKOFF);
        let backoff_until = now.saturating_add(backoff).unwrap_or(Timestamp::MAX);
        failures.backoff_until = Some(backoff_until);
        Some((count, backoff_until))
    }

    /// Records that a worker has completed a job, which ends its failures in a row.
    pub fn record_success(&self, name: &str) {
        self.lock().failing.remove(name);
    }

    /// Why a worker gets no jobs after failures; `None` if it does not back off at `now`.
    #[must_use]
    pub fn backoff_reason(&self, name: &str, now: Timestamp) -> Option<String> {
        let state = self.lock();
        let failures = state.failing.get(name)?;
        let until = failures.backoff_until.filter(|until| *until > now)?;
        Some(format!(
            "its last {} jobs failed, and it gets none before {}: look into its log, and run `faceoff doctor` there",
            failures.jobs.len(),
            until.strftime("%Y-%m-%d %H:%M:%S UTC")
        ))
    }

    /// Records that no slot runs this job any more.
    pub fn end_job(&self, job: Uuid) {
        for worker in self.lock().workers.values_mut() {
            worker.busy_slots.retain(|_, busy| busy.job != job);
        }
    }

    /// Records that no slot of this worker runs a job any more.
    pub fn end_jobs_of(&self, worker: &str) {
        if let Some(worker) = self.lock().workers.get_mut(worker) {
            worker.busy_slots.clear();
        }
    }

    /// All known workers, by name.
    #[must_use]
    pub fn all(&self) -> Vec<WorkerStatus> {
        self.lock().workers.values().cloned().collect()
    }

    /// Number of slots of the remote workers that can get jobs now.
    #[must_use]
    pub fn available_slots(&self, now: Timestamp) -> u32 {
        let state = self.lock();
        let available = state
            .workers
            .values()
            .filter(|worker| worker.refusal.is_none() && worker.is_online(now));
        available.map(WorkerStatus::slots).sum()
    }

    /// Sets the problem that prevents the server from doing an operation for remote workers; `None`: it is solved.
    pub fn set_problem(&self, operation: &str, cause: Option<&str>) {
        let mut state = self.lock();
        match cause {
            Some(cause) => drop(
                state
                    .problems
                    .insert(operation.to_owned(), cause.to_owned()),
            ),
            None => drop(state.problems.remove(operation)),
        }
    }

    /// Does a problem prevent the server from doing this operation?
    #[must_use]
    pub fn has_problem(&self, operation: &str) -> bool {
        self.lock().problems.contains_key(operation)
    }

    /// The operations that the server cannot do for remote workers, with the causes.
    #[must_use]
    pub fn problems(&self) -> Vec<(String, String)> {
        let state = self.lock();
        let problems = state.problems.iter();
        problems
            .map(|(operation, cause)| (operation.clone(), cause.clone()))
            .collect()
    }

    /// Begins the upload of a file of the job leased under this nonce; `None` if the job's files are closed.
    #[must_use]
    pub fn begin_upload(&self, nonce: Uuid) -> Option<UploadGuard> {
        let mut state = self.lock();
        let files = state.files.entry(nonce).or_default();
        if files.are_closed {
            return None;
        }
        files.uploads += 1;
        let workers = self.clone();
        Some(UploadGuard { nonce, workers })
    }

    /// Closes the files of the job leased under this nonce: no upload can begin. False while an upload is running.
    #[must_use]
    pub fn close_files(&self, nonce: Uuid) -> bool {
        let mut state = self.lock();
        let files = state.files.entry(nonce).or_default();
        files.are_closed = true;
        files.uploads == 0
    }

    /// Forgets the files of a lease under which no upload is possible any more.
    pub fn forget_files(&self, nonce: Uuid) {
        self.lock().files.remove(&nonce);
    }

    /// A panic of another thread leaves the state consistent, so poisoning is ignored.
    fn lock(&self) -> MutexGuard<'_, WorkersState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
