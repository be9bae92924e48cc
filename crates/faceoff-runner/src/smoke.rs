use crate::{
    bundle::Bundle,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_watch::{Counters, HostWatch},
    log::Log,
    player::{IfTheHostWins, Player},
    waited::Waited,
};
use faceoff_episode::{Answered, Arena, EpisodeStart, RecordError, StepRow, StepSink};
use faceoff_sandbox::affinity::PinnedElsewhere;
use faceoff_scoring::computation_time_penalty;
use faceoff_sim::EPISODE_STEPS;
use faceoff_types::{AgentFault, EpisodeOutcome, Profile, SmokeTiming, Task};
use faceoff_wire::work::SmokeSpec;
use std::fmt;

/// Control steps of each task over which an agent's time is judged, at least (RULES).
pub const SMOKE_STEPS: u32 = 250;

/// What the smoke run of an upload found.
#[derive(Debug, Clone, PartialEq)]
pub struct SmokeReport {
    /// The first thing that was wrong, if anything was.
    pub defect: Option<SmokeDefect>,
    /// How long the answers took, for each task as far as it was played.
    pub timing: Vec<SmokeTiming>,
    /// The end of the agent's standard error.
    pub log: String,
}

/// Why an upload is refused.
#[derive(Debug, Clone, PartialEq)]
pub enum SmokeDefect {
    /// The agent broke the protocol or a limit.
    Fault {
        fault: AgentFault,
        /// If by an answer that did not come: whose time that was.
        waited: Option<Waited>,
    },
    /// It answers, but not in real time.
    TooSlow {
        timing: SmokeTiming,
        /// What the mean may be, in seconds.
        limit_s: f64,
        /// What the host took of an answer in the mean, in seconds: it is not in the timing.
        host_mean_s: f64,
        /// For how long the agent's processes ran for an answer in the mean, in seconds, where the host
        /// tells.
        cpu_mean_s: Option<f64>,
    },
}

impl fmt::Display for SmokeDefect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault {
                fault,
                waited: None,
            } => fault.fmt(f),
            Self::Fault {
                fault,
                waited: Some(waited),
            } => write!(f, "{fault} ({waited})"),
            Self::TooSlow {
                timing,
                limit_s,
                host_mean_s,
                cpu_mean_s,
            } => {
                write!(
                    f,
                    "{}: too slow: {} answers took {:.1} ms in the mean, and {:.0} ms are allowed: the \
                     robot asks in real time (not counted: {:.1} ms in the mean that the host took",
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

/// Does the agent start, answer and keep time? Episodes of each task like those of an evaluation,
/// in the same sandbox and with the same limits, until at least [`SMOKE_STEPS`] control steps of it
/// are played; ends with the first defect. Which episodes and how many follow from the order's seed,
/// so that an agent cannot tell this run from one that counts.
///
/// # Errors
/// The platform's alone; the agent's fault is in the report. [`PlatformFault::Cancelled`] when
/// `cancelled`, which is asked before each step, said so; [`PlatformFault::HostBusy`] when the host kept
/// the agent from answering as often as an episode may be played again: that is no verdict.
pub fn smoke(
    spec: &SmokeSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    cancelled: &dyn Fn() -> bool,
) -> Result<SmokeReport, PlatformFault> {
    smoke_watched(spec, bundle, env, cancelled, &Counters)
}

/// [`smoke`] with another judge of what the host takes.
///
/// # Errors
/// As [`smoke`].
pub fn smoke_watched(
    spec: &SmokeSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    cancelled: &dyn Fn() -> bool,
    watch: &dyn HostWatch,
) -> Result<SmokeReport, PlatformFault> {
    let _pinned = PinnedElsewhere::than(&env.agent_cpus);
    let arena = Arena::new(Profile::Evaluation, spec.seed, spec.mismatch_seed);
    let mut timing = Vec::with_capacity(Task::ALL.len());
    let mut log = Log::new(env.limits.stderr_tail_bytes);
    for task in Task::ALL {
        let part = Part::drawn(spec, task);
        let mut player = Player::new(
            bundle,
            env,
            task,
            part.episodes,
            arena.clone(),
            watch,
            IfTheHostWins::OurFault,
        );
        let mut answers = Answers::default();
        let mut outcomes = Vec::new();
        while answers.answered.len() < part.steps as usize {
            let episode = part.first_episode + outcomes.len() as u32;
            let outcome = player.play(episode, EPISODE_STEPS, &mut answers, cancelled)?;
            let faulty = outcome.fault.is_some();
            outcomes.push(outcome);
            if faulty {
                break;
            }
        }
        let waited = player.waited();
        log.add(&player.close()?, None);
        let (host_mean_s, cpu_mean_s) = answers.beside_the_wall();
        let summary = answers.summary(task, &outcomes);
        let fault = outcomes.into_iter().find_map(|outcome| outcome.fault);
        let defect = match fault {
            Some(fault) => Some(SmokeDefect::Fault { fault, waited }),
            None if summary.mean_s > env.time.mean_s => Some(SmokeDefect::TooSlow {
                timing: summary.clone(),
                limit_s: env.time.mean_s,
                host_mean_s,
                cpu_mean_s,
            }),
            None => None,
        };
        timing.push(summary);
        if defect.is_some() {
            return Ok(SmokeReport {
                defect,
                timing,
                log: log.into_text(),
            });
        }
    }
    Ok(SmokeReport {
        defect: None,
        timing,
        log: log.into_text(),
    })
}

/// What is played of one task.
struct Part {
    /// Where a shard of an evaluation would begin.
    first_episode: u32,
    /// About as many as the steps need.
    episodes: u32,
    /// Episodes are begun until so many control steps are played.
    steps: u32,
}

impl Part {
    /// A beginning like that of a shard, since an agent is told the number of its episode.
    const SHARD_EPISODES: u32 = 50;
    const SHARDS: u32 = 20;

    fn drawn(spec: &SmokeSpec, task: Task) -> Self {
        let drawn = spec.seed.derive("smoke", task.as_str().as_bytes());
        let [a, b, c, d, e, f, g, h, ..] = *drawn.as_bytes();
        let shard = u32::from_le_bytes([a, b, c, d]) % Self::SHARDS;
        let more = u32::from_le_bytes([e, f, g, h]) % SMOKE_STEPS;
        Self {
            first_episode: shard * Self::SHARD_EPISODES,
            episodes: Self::SHARD_EPISODES,
            steps: SMOKE_STEPS + more,
        }
    }
}

/// All answers; of a try that is played again the last ones count.
#[derive(Default)]
struct Answers {
    answered: Vec<Answered>,
    /// How many belong to episodes that have ended.
    ended: usize,
}

impl Answers {
    fn mean_s(&self, of: impl Fn(&Answered) -> f64) -> f64 {
        self.answered.iter().map(of).sum::<f64>() / self.answered.len().max(1) as f64
    }

    /// What the host took of an answer in the mean, and for how long the agent's processes ran, where the
    /// host tells; in seconds.
    fn beside_the_wall(&self) -> (f64, Option<f64>) {
        let tells = self.answered.iter().all(|one| one.cpu_time_s.is_some());
        let cpu_s = tells.then(|| self.mean_s(|one| one.cpu_time_s.unwrap_or_default()));
        (self.mean_s(|one| one.host_time_s), cpu_s)
    }

    fn summary(&self, task: Task, outcomes: &[EpisodeOutcome]) -> SmokeTiming {
        let times = self.answered.iter().map(|one| one.computation_time_s);
        let mut times_s: Vec<f64> = times.collect();
        times_s.sort_unstable_by(f64::total_cmp);
        let rank = (times_s.len() * 99).div_ceil(100);
        let points: f64 = outcomes
            .iter()
            .map(|outcome| computation_time_penalty(&outcome.computation_time))
            .sum();
        SmokeTiming {
            task,
            steps: times_s.len() as u32,
            mean_s: self.mean_s(|one| one.computation_time_s),
            p99_s: rank.checked_sub(1).map_or(0.0, |at| times_s[at]),
            max_s: times_s.last().copied().unwrap_or_default(),
            points_per_episode: points / outcomes.len().max(1) as f64,
        }
    }
}

impl StepSink for Answers {
    fn begin(&mut self, _: EpisodeStart<'_>) {
        self.answered.truncate(self.ended);
    }

    fn observe(&mut self, _: &[f64]) {}

    fn step(&mut self, row: &StepRow<'_>) {
        self.answered.push(row.answered);
    }

    fn end(&mut self, _: &EpisodeOutcome, _: u32) -> Result<(), RecordError> {
        self.ended = self.answered.len();
        Ok(())
    }
}
