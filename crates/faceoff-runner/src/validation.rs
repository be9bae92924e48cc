//! The *validation run* of a submission: a few episodes of each task, which show whether the agent starts, answers and
//! keeps real time.

use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_interference::{InterferenceMonitor, KernelCounters},
    log::Log,
    player::{OnHostInterference, Player},
    wait_breakdown::WaitBreakdown,
};
use faceoff_episode::{AnswerTiming, Conditions, EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_sandbox::affinity::AffinityGuard;
use faceoff_scoring::computation_time_penalty;
use faceoff_types::{
    AgentFault, EpisodeOutcome, Task, ValidationTiming, ViolatedLimit, ViolationName,
};
use faceoff_wire::job::ValidationSpec;
use std::{fmt, ops::Range};

/// Minimum number of control steps per task in a validation run.
pub const VALIDATION_STEPS: u32 = 250;

/// Result of a validation run.
#[derive(Debug, Clone, PartialEq)]
pub struct ValidationReport {
    /// Why the submission is invalid; `None` if it is valid.
    pub failure: Option<ValidationFailure>,
    /// Answer times of the tasks that were played, in their order; a failure ends the run.
    pub timing: Vec<ValidationTiming>,
    /// The agent's standard error (its beginning and end, if it is long), with its faults.
    pub log: String,
}

/// Why a submission is invalid.
#[derive(Debug, Clone, PartialEq)]
pub enum ValidationFailure {
    /// The agent broke the protocol or a limit.
    Fault {
        fault: AgentFault,
        /// The wait for the missing answer, if that was the fault.
        wait: Option<WaitBreakdown>,
    },
    /// The agent answers, but not in real time.
    TooSlow {
        timing: ValidationTiming,
        /// Limit of the mean, in seconds.
        limit_s: f64,
        /// Mean host interference per answer, in seconds; not included in `timing`.
        host_mean_s: f64,
        /// Mean CPU time of the agent's processes per answer, in seconds; `None` if the host does not report it.
        cpu_mean_s: Option<f64>,
    },
}

impl fmt::Display for ValidationFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault { fault, wait: None } => fault.fmt(f),
            Self::Fault {
                fault,
                wait: Some(wait),
            } => write!(f, "{fault} ({wait})"),
            Self::TooSlow {
                timing,
                limit_s,
                host_mean_s,
                cpu_mean_s,
            } => {
                write!(
                    f,
                    "{}: too slow: {} answers took {:.1} ms on average, and {:.0} ms are allowed: the \
                     robot asks in real time (not counted: {:.1} ms of host interference on average",
                    timing.task,
                    timing.steps,
                    1e3 * timing.mean_s,
                    1e3 * limit_s,
                    1e3 * host_mean_s,
                )?;
                if let Some(cpu_s) = cpu_mean_s {
                    write!(f, "; the agent's processes ran {:.1} ms", 1e3 * cpu_s)?;
                }
                f.write_str(")")
            }
        }
    }
}

/// Runs a validation: checks that the agent starts, answers and keeps real time.
///
/// Runs episodes of each task as in an evaluation, in the same sandbox and with the same limits, until at least
/// [`VALIDATION_STEPS`] control steps of the task are played. Ends with the first failure. The episodes, their numbers and
/// their conditions are those of a shard of an evaluation, and the spec's seed determines how many are played, so that an agent
/// cannot distinguish this run from an evaluation.
///
/// # Errors
/// Platform faults only; an agent fault is in the report. [`PlatformFault::Cancelled`] if `cancelled`, which is called
/// before each step, returned `true`. [`PlatformFault::HostBusy`] if host interference ended an episode in all allowed
/// tries; then there is no verdict on the agent.
pub fn validate(
    spec: &ValidationSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    cancelled: &dyn Fn() -> bool,
) -> Result<ValidationReport, PlatformFault> {
    validate_monitored(spec, bundle, env, cancelled, &KernelCounters)
}

/// [`validate`] with another monitor of host interference.
///
/// # Errors
/// As [`validate`].
pub fn validate_monitored(
    spec: &ValidationSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    cancelled: &dyn Fn() -> bool,
    monitor: &dyn InterferenceMonitor,
) -> Result<ValidationReport, PlatformFault> {
    let _affinity_guard = AffinityGuard::avoid(&env.agent_cpus);
    let world_factory = env.simulator.world_factory(&Conditions {
        ruleset: spec.ruleset,
        profile: spec.profile,
        perturbations: &spec.perturbations,
        seed: spec.seed,
        mismatch_seed: spec.mismatch_seed,
    })?;
    let mut timing = Vec::with_capacity(spec.tasks.len());
    let mut log = Log::new(env.limits.stderr_kept_bytes);
    for task in spec.tasks.iter().copied() {
        let TaskPlan {
            mut shards,
            min_steps,
        } = TaskPlan::new(spec, task);
        let mut answers = Answers::default();
        let mut outcomes: Vec<EpisodeOutcome> = Vec::new();
        let mut wait = None;
        let is_complete = |answers: &Answers, outcomes: &[EpisodeOutcome]| {
            let has_fault = outcomes.last().is_some_and(|last| last.fault.is_some());
            has_fault || answers.timings.len() >= min_steps as usize
        };
        // An agent plays one shard in an evaluation. If a shard is too short, another agent plays the next.
        while !is_complete(&answers, &outcomes) {
            let episodes = shards.next_episodes();
            let mut player = Player::new(
                bundle,
                env,
                task,
                episodes.end - episodes.start,
                world_factory.as_ref(),
                monitor,
                OnHostInterference::PlatformFault,
            );
            for episode in episodes {
                outcomes.push(player.play(
                    episode,
                    world_factory.max_steps(task),
                    &mut answers,
                    cancelled,
                )?);
                if is_complete(&answers, &outcomes) {
                    break;
                }
            }
            wait = player.last_wait();
            log.add(&player.finish()?, None);
        }
        let (host_mean_s, cpu_mean_s) = answers.mean_host_and_cpu_s();
        let summary = answers.summary(task, &outcomes);
        let fault = outcomes.into_iter().find_map(|outcome| outcome.fault);
        let failure = match fault {
            Some(fault) => Some(ValidationFailure::Fault { fault, wait }),
            None if summary.mean_s > env.time.mean_s => Some(ValidationFailure::TooSlow {
                timing: summary.clone(),
                limit_s: env.time.mean_s,
                host_mean_s,
                cpu_mean_s,
            }),
            None => None,
        };
        timing.push(summary);
        if failure.is_some() {
            return Ok(ValidationReport {
                failure,
                timing,
                log: log.into_text(),
            });
        }
    }
    Ok(ValidationReport {
        failure: None,
        timing,
        log: log.into_text(),
    })
}

/// The episodes of one task in a validation run.
struct TaskPlan {
    shards: Shards,
    /// Episodes are started until this many control steps are played.
    min_steps: u32,
}

impl TaskPlan {
    fn new(spec: &ValidationSpec, task: Task) -> Self {
        // The label “smoke” is part of the seed: another one would change the episodes.
        let derived = spec.seed.derive("smoke", task.as_str().as_bytes());
        let [a, b, c, d, e, f, g, h, ..] = *derived.as_bytes();
        let count = spec.episodes_per_task.div_ceil(spec.episodes_per_shard);
        let extra_steps = u32::from_le_bytes([e, f, g, h]) % VALIDATION_STEPS;
        Self {
            shards: Shards {
                episodes_per_task: spec.episodes_per_task,
                episodes_per_shard: spec.episodes_per_shard,
                count,
                next: u32::from_le_bytes([a, b, c, d]) % count,
            },
            min_steps: VALIDATION_STEPS + extra_steps,
        }
    }
}

/// The shards of an evaluation, starting at a random one; after the last follows the first. The protocol tells the agent each episode's
/// number, so a validation run uses the numbers of an evaluation's shards.
struct Shards {
    episodes_per_task: u32,
    episodes_per_shard: u32,
    /// Number of shards.
    count: u32,
    /// Index of the next shard, from 0.
    next: u32,
}

impl Shards {
    /// The episodes of the next shard.
    fn next_episodes(&mut self) -> Range<u32> {
        let start = self.next * self.episodes_per_shard;
        let end = start.saturating_add(self.episodes_per_shard);
        self.next = (self.next + 1) % self.count;
        start..end.min(self.episodes_per_task)
    }
}

/// The times of the answers of all episodes, collected while they are played. If an episode is run again, only its last try counts.
#[derive(Default)]
struct Answers {
    timings: Vec<AnswerTiming>,
    /// Number of answers in completed episodes.
    completed: usize,
}

impl Answers {
    fn mean_s(&self, quantity: impl Fn(&AnswerTiming) -> f64) -> f64 {
        self.timings.iter().map(quantity).sum::<f64>() / self.timings.len().max(1) as f64
    }

    /// Mean host interference and mean CPU time of the agent per answer, in seconds; the latter is `None` if the host
    /// does not report it.
    fn mean_host_and_cpu_s(&self) -> (f64, Option<f64>) {
        let has_cpu_times = self
            .timings
            .iter()
            .all(|timing| timing.cpu_time_s.is_some());
        let cpu_s =
            has_cpu_times.then(|| self.mean_s(|timing| timing.cpu_time_s.unwrap_or_default()));
        (self.mean_s(|timing| timing.host_time_s), cpu_s)
    }

    fn summary(&self, task: Task, outcomes: &[EpisodeOutcome]) -> ValidationTiming {
        let times = self.timings.iter().map(|timing| timing.computation_time_s);
        let mut times_s: Vec<f64> = times.collect();
        times_s.sort_unstable_by(f64::total_cmp);
        // Nearest rank of the 99th percentile, from 1.
        let rank = (times_s.len() * 99).div_ceil(100);
        let penalty_points: f64 = outcomes
            .iter()
            .map(|outcome| computation_time_penalty(&outcome.computation_time))
            .sum();
        ValidationTiming {
            task,
            steps: times_s.len() as u32,
            mean_s: self.mean_s(|timing| timing.computation_time_s),
            p99_s: rank.checked_sub(1).map_or(0.0, |index| times_s[index]),
            max_s: times_s.last().copied().unwrap_or_default(),
            points_per_episode: penalty_points / outcomes.len().max(1) as f64,
            episodes: outcomes.len() as u32,
            violations: violated_limits(outcomes),
        }
    }
}

/// The violated limits of the robot, with the number of episodes of each.
fn violated_limits(outcomes: &[EpisodeOutcome]) -> Vec<ViolatedLimit> {
    let mut limits: Vec<ViolatedLimit> = Vec::new();
    let violated = outcomes
        .iter()
        .flat_map(|outcome| outcome.violations.violated());
    for limit in violated.filter(|limit| *limit != ViolationName::COMPUTATION_TIME) {
        match limits.iter_mut().find(|violated| violated.limit == limit) {
            Some(violated) => violated.episodes += 1,
            None => limits.push(ViolatedLimit { limit, episodes: 1 }),
        }
    }
    limits
}

impl StepSink for Answers {
    fn begin(&mut self, _: EpisodeStart<'_>) {
        self.timings.truncate(self.completed);
    }

    fn observe(&mut self, _: &[f64]) {}

    fn step(&mut self, row: &StepRow<'_>) {
        self.timings.push(row.timing);
    }

    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.completed = self.timings.len();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_episodes_wraps_around_after_the_last_shard() {
        let mut shards = Shards {
            episodes_per_task: 12,
            episodes_per_shard: 5,
            count: 3,
            next: 1,
        };
        for expected in [5..10, 10..12, 0..5, 5..10] {
            assert_eq!(shards.next_episodes(), expected);
        }
    }
}
