//! Threads that run the shards of an evaluation in parallel. A *shard* is a range of episodes of one task.

use super::logs::Logs;
use crate::commands::{
    side_notes::Notes,
    silent_agent::{self, is_silent_start},
};
use anyhow::Context;
use faceoff_runner::{
    AgentEnvironment, Observer, PlatformFault, ShardSpec, bundle::Bundle, run_shard,
};
use faceoff_types::{AgentFault, AgentFaultKind, EpisodeOutcome, Task};
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    collections::VecDeque,
    fmt,
    path::PathBuf,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU32, Ordering},
        mpsc,
    },
    thread,
};

/// A shard and the folder for its recording.
#[derive(Debug)]
pub(super) struct Job {
    pub out: PathBuf,
    pub spec: ShardSpec,
}

/// Outcome of all shards together.
pub(super) enum EvalOutcome {
    /// All episodes are finished, with no more faults than allowed.
    Finished {
        faults: Vec<AgentFault>,
        /// Sorted by task and episode.
        outcomes: Vec<EpisodeOutcome>,
        logs: Logs,
    },
    /// The agent had more faults than allowed.
    Failed { faults: Vec<AgentFault>, logs: Logs },
    /// A start of the agent timed out before any of its processes had answered.
    NeverAnswered { fault: AgentFault, logs: Logs },
}

/// State that the worker threads share.
struct Pool {
    jobs: Mutex<VecDeque<Job>>,
    faults: Mutex<Vec<AgentFault>>,
    outcomes: Mutex<Vec<EpisodeOutcome>>,
    logs: Mutex<Logs>,
    fault_count: AtomicU32,
    max_faults: u32,
    /// Ends all shards: there are too many faults, or the agent never answered, or a platform fault has occurred.
    stop: AtomicBool,
    /// Has any process of the agent answered?
    has_answered: AtomicBool,
    /// Ends the wait for the first answer.
    first_answer: mpsc::Sender<()>,
    /// Was the run stopped because the agent had answered nothing?
    was_silent: AtomicBool,
    /// The kinds of the faults that were printed.
    printed: Mutex<Vec<AgentFaultKind>>,
    bar: ProgressBar,
    notes: Notes,
}

/// Runs all shards, with one thread and one agent process per environment.
pub(super) fn run_shards(
    bundle: &Bundle,
    envs: &[AgentEnvironment],
    jobs: Vec<Job>,
    notes: Notes,
) -> anyhow::Result<EvalOutcome> {
    let episodes: u64 = jobs.iter().map(|job| job.spec.episodes.len() as u64).sum();
    let max_faults = jobs.first().map_or(0, |job| job.spec.max_faults);
    // The jobs are in the order of the tasks.
    let tasks: Vec<Task> = jobs.iter().map(|job| job.spec.task).collect();
    // indicatif draws nothing if standard error is no terminal.
    let bar = ProgressBar::new(episodes).with_style(
        ProgressStyle::with_template(
            "{msg:8} {bar:40} {pos}/{len} episodes, {per_sec}, {eta} left",
        )
        .context("the progress bar's template")?,
    );
    let (first_answer, answers) = mpsc::channel();
    let pool = Pool {
        jobs: Mutex::new(jobs.into()),
        faults: Mutex::default(),
        outcomes: Mutex::default(),
        logs: Mutex::default(),
        fault_count: AtomicU32::new(0),
        max_faults,
        stop: AtomicBool::new(false),
        has_answered: AtomicBool::new(false),
        first_answer,
        was_silent: AtomicBool::new(false),
        printed: Mutex::default(),
        bar,
        notes,
    };
    let results: Vec<Result<(), PlatformFault>> = thread::scope(|scope| {
        let pool = &pool;
        let _guard = AnswerWaitGuard(pool);
        scope.spawn(move || {
            silent_agent::explain(&["the agent"], &answers, |note| pool.print(note));
        });
        let workers: Vec<_> = envs
            .iter()
            .enumerate()
            .map(|(index, env)| {
                thread::Builder::new()
                    .name(format!("worker-{index}"))
                    .spawn_scoped(scope, || pool.run_jobs(bundle, env))
            })
            .collect();
        workers
            .into_iter()
            .map(|worker| match worker {
                Ok(worker) => worker
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
                Err(source) => Err(PlatformFault::Io {
                    action: "starting a worker".to_owned(),
                    source,
                }),
            })
            .collect()
    });
    pool.bar.finish_and_clear();
    for result in results {
        match result {
            Ok(()) | Err(PlatformFault::Cancelled) => {}
            Err(fault) => {
                return Err(fault)
                    .context("the evaluation failed by a platform fault, not by the agent");
            }
        }
    }
    let mut faults = into_inner(pool.faults);
    let task_position = |task: Task| tasks.iter().position(|other| *other == task);
    faults.sort_by_key(|fault| (task_position(fault.agent_task.name()), fault.episode));
    let logs = into_inner(pool.logs);
    if pool.was_silent.load(Ordering::Relaxed)
        && let Some(position) = faults
            .iter()
            .position(|fault| is_silent_start(&fault.fault))
    {
        let fault = faults.swap_remove(position);
        return Ok(EvalOutcome::NeverAnswered { fault, logs });
    }
    if faults.len() > max_faults as usize {
        Ok(EvalOutcome::Failed { faults, logs })
    } else {
        let mut outcomes = into_inner(pool.outcomes);
        outcomes.sort_by_key(|outcome| (task_position(outcome.task), outcome.episode));
        Ok(EvalOutcome::Finished {
            faults,
            outcomes,
            logs,
        })
    }
}

impl Pool {
    /// Ends the wait for the first answer: there is one, or the run is over.
    fn end_wait_for_answer(&self) {
        // Without a receiver, the wait is over already.
        let _ended = self.first_answer.send(());
    }

    /// Prints a line without disturbing the progress bar.
    fn print(&self, line: fmt::Arguments<'_>) {
        self.bar.suspend(|| self.notes.print(line));
    }

    /// Prints a fault, unless one of the same kind was printed.
    fn print_fault(&self, fault: &AgentFault) {
        let mut printed = lock(&self.printed);
        if !printed.contains(&fault.fault) {
            self.print(format_args!("fault: {fault}"));
            printed.push(fault.fault.clone());
        }
    }

    fn run_jobs(&self, bundle: &Bundle, env: &AgentEnvironment) -> Result<(), PlatformFault> {
        loop {
            let job = lock(&self.jobs).pop_front();
            let Some(Job { out, mut spec }) = job else {
                return Ok(());
            };
            // The limit applies to the evaluation, not to the shard.
            let faults_so_far = self.fault_count.load(Ordering::Relaxed);
            spec.max_faults = self.max_faults.saturating_sub(faults_so_far);
            self.bar.set_message(spec.task.to_string());
            if let Err(fault) = run_shard(&spec, bundle, env, &out, &mut PoolObserver(self)) {
                self.stop.store(true, Ordering::Relaxed);
                return Err(fault);
            }
        }
    }
}

/// Ends the wait for the first answer when the run ends, also if a worker panics.
struct AnswerWaitGuard<'a>(&'a Pool);

impl Drop for AnswerWaitGuard<'_> {
    fn drop(&mut self) {
        self.0.end_wait_for_answer();
    }
}

/// Reports the progress of one thread to the pool.
struct PoolObserver<'a>(&'a Pool);

impl Observer for PoolObserver<'_> {
    fn on_episode_end(&mut self, outcome: &EpisodeOutcome) {
        self.0.bar.inc(1);
        lock(&self.0.outcomes).push(outcome.clone());
        if let Some(fault) = &outcome.fault {
            self.0.print_fault(fault);
            lock(&self.0.faults).push(fault.clone());
            // The other starts would end in the same way, so the run stops.
            if is_silent_start(&fault.fault) && !self.0.has_answered.load(Ordering::Relaxed) {
                self.0.was_silent.store(true, Ordering::Relaxed);
                self.0.stop.store(true, Ordering::Relaxed);
            }
            if self.0.fault_count.fetch_add(1, Ordering::Relaxed) >= self.0.max_faults {
                self.0.stop.store(true, Ordering::Relaxed);
            }
        }
    }

    fn log(&mut self, log: &str) {
        lock(&self.0.logs).add(log);
    }

    fn on_agent_running(&self) {
        let has_answered = &self.0.has_answered;
        if !has_answered.load(Ordering::Relaxed) && !has_answered.swap(true, Ordering::Relaxed) {
            self.0.end_wait_for_answer();
        }
    }

    fn cancelled(&self) -> bool {
        self.0.stop.load(Ordering::Relaxed)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn into_inner<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}
