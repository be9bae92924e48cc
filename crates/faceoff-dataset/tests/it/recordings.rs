//! Helpers that record evaluations. Their agents are functions: no process, no clock, the same numbers on every machine.

use arrow_array::RecordBatch;
use faceoff_airhockey::{EVALUATION, HIT, simulator};
use faceoff_dataset::{
    AssembledDataset, Recorder, RecordingError, ShardFolder, ShardReport, assemble,
    shard_conditions,
};
use faceoff_episode::{AnswerTiming, EpisodeStart, Simulator, StepRow, StepSink, World};
use faceoff_sim::{EPISODE_STEPS, Interpolation};
use faceoff_types::{
    AgentFault, AgentFaultKind, ComputationTime, EpisodeEnd, EpisodeOutcome, RoundTrips, Seed,
    SlotTiming, Task, Variation,
};
use faceoff_wire::job::{EvaluationMeta, ShardSpec};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::{
    fs::{self, File},
    ops::Range,
    path::{Path, PathBuf},
    time::Duration,
};
use tempfile::TempDir;
use zip::ZipArchive;

/// A question to an agent.
pub struct Question {
    pub episode: u32,
    /// `None` at the reset.
    pub step: Option<u32>,
    /// Joint positions in the episode's first observation, rad.
    pub initial_joints: [f64; 7],
}

/// Answers with joint positions and velocities, or with a fault (`None`).
pub type Agent = fn(&Question) -> Option<[[f64; 7]; 2]>;

/// Commands the initial joint positions in each step.
pub fn hold_still(question: &Question) -> Option<[[f64; 7]; 2]> {
    Some([question.initial_joints, [0.0; 7]])
}

/// Moves the arm, so that every column changes.
pub fn swing_arm(question: &Question) -> Option<[[f64; 7]; 2]> {
    let offset = 0.002 * f64::from(question.step.unwrap_or(0) % 7);
    Some([question.initial_joints.map(|q| q + offset), [0.1; 7]])
}

/// The specification of a shard under the current ruleset.
pub fn spec(task: Task, episodes: Range<u32>) -> ShardSpec {
    let seed = Seed::from_number(7);
    ShardSpec {
        ruleset: faceoff_airhockey::RULESET,
        platform_retries: 0,
        task,
        episodes,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        max_faults: 2,
        perturbations: Default::default(),
    }
}

/// Records a shard; an agent that is `None` fails to start.
pub fn play(spec: &ShardSpec, agent: Option<Agent>, out: &Path) -> ShardReport {
    let folder = ShardFolder::create(out).unwrap();
    let mut recorder = Recorder::create(&folder, spec.task, simulator().competition()).unwrap();
    let world_factory = simulator().world_factory(&shard_conditions(spec)).unwrap();
    let mut outcomes = Vec::new();
    for episode in spec.episodes.clone() {
        let layout = agent.map(|_| Interpolation::Cubic.into());
        let mut world = world_factory.reset(spec.task, episode, layout).unwrap();
        recorder.begin(EpisodeStart {
            episode,
            seed: world_factory.seed(spec.task, episode),
            layout,
            world: world.as_ref(),
        });
        let outcome = match agent {
            Some(agent) => play_episode(spec.task, episode, agent, world.as_mut(), &mut recorder),
            None => outcome_after_fault(spec.task, None, None, episode, world.as_ref(), &[]),
        };
        recorder.end(&outcome, 0).unwrap();
        outcomes.push(outcome);
        let faults = outcomes.iter().filter(|outcome| outcome.fault.is_some());
        if faults.count() > spec.max_faults as usize {
            break;
        }
    }
    recorder.finish().unwrap();
    let round_trips = RoundTrips {
        count: 10,
        p50: 1e-5,
        p99: 2e-5,
        max: 3e-5 + f64::from(spec.episodes.start) * 1e-6,
    };
    let report = ShardReport {
        stopped_by_faults: outcomes.len() < spec.episodes.len(),
        outcomes,
        log: "goodbye\n".to_owned(),
        timing: SlotTiming {
            before_s: round_trips,
            during_s: round_trips,
            max_host_interference_s: 0.0,
            host_interference_reruns: 0,
            platform_retries: spec.platform_retries,
        },
    };
    folder.commit(spec, &report, simulator().as_ref()).unwrap();
    report
}

fn play_episode(
    task: Task,
    episode: u32,
    agent: Agent,
    world: &mut dyn World,
    recorder: &mut Recorder,
) -> EpisodeOutcome {
    let mut initial_joints = [0.0; 7];
    // Joint positions follow the puck's six numbers.
    initial_joints.copy_from_slice(&world.observation()[6..13]);
    let ask = |step| {
        agent(&Question {
            episode,
            step,
            initial_joints,
        })
    };
    if ask(None).is_none() {
        return outcome_after_fault(task, Some(episode), None, episode, world, &[]);
    }
    let mut times_s = Vec::new();
    loop {
        let step = world.steps();
        let Some(action) = ask(Some(step)) else {
            return outcome_after_fault(task, Some(episode), Some(step), episode, world, &times_s);
        };
        // Times around 0.1 ms that differ from step to step: two primes make them look irregular.
        let time = Duration::from_nanos(100_000 + u64::from(step) * 7919 % 977);
        times_s.push(time.as_secs_f64());
        recorder.observe(world.observation());
        let end = world.step(action.as_flattened());
        recorder.step(&StepRow {
            step,
            action: action.as_flattened(),
            timing: AnswerTiming {
                computation_time_s: time.as_secs_f64(),
                host_time_s: 0.0,
                cpu_time_s: (!step.is_multiple_of(5)).then(|| (time / 2).as_secs_f64()),
            },
            next_observation: world.observation(),
            world: &*world,
        });
        if let Some(detail) = world.divergence() {
            let mut outcome =
                outcome_after_fault(task, Some(episode), Some(step), episode, world, &times_s);
            let fault = AgentFaultKind::Diverged { detail };
            outcome.fault.as_mut().unwrap().fault = fault;
            return outcome;
        }
        if let Some(end) = end.or_else(|| horizon(world)) {
            return EpisodeOutcome {
                task,
                episode,
                steps: world.steps(),
                end,
                success: world.success(),
                violations: world.violations(),
                computation_time: summary(&times_s),
                fault: None,
            };
        }
    }
}

/// The end of an episode after its last control step.
fn horizon(world: &dyn World) -> Option<EpisodeEnd> {
    (world.steps() >= EPISODE_STEPS).then_some(EpisodeEnd::HORIZON)
}

/// The outcome of an episode that an agent fault ended. `fault_episode` and `fault_step` are those of the fault: `None` for a
/// fault at the agent's start or at the reset.
fn outcome_after_fault(
    task: Task,
    fault_episode: Option<u32>,
    fault_step: Option<u32>,
    episode: u32,
    world: &dyn World,
    times_s: &[f64],
) -> EpisodeOutcome {
    EpisodeOutcome {
        task,
        episode,
        steps: world.steps(),
        end: EpisodeEnd::AGENT_FAULT,
        success: false,
        violations: world.violations(),
        computation_time: summary(times_s),
        fault: Some(AgentFault {
            fault: AgentFaultKind::NonFinite,
            agent_task: task.into(),
            episode: fault_episode,
            step: fault_step,
            line: None,
        }),
    }
}

fn summary(times_s: &[f64]) -> ComputationTime {
    ComputationTime {
        mean_s: times_s.iter().fold(0.0, |sum, time_s| sum + time_s) / times_s.len().max(1) as f64,
        max_s: times_s.iter().copied().fold(0.0, f64::max),
    }
}

/// The shards of an evaluation and the folder of its dataset.
pub struct Evaluation {
    pub dir: TempDir,
    pub shards: Vec<PathBuf>,
    pub reports: Vec<ShardReport>,
    pub meta: EvaluationMeta,
}

impl Evaluation {
    pub fn play(agent: Option<Agent>, shards: &[(Task, Range<u32>)]) -> Self {
        Self::play_with_variation(Variation::default(), agent, shards)
    }

    pub fn play_with_variation(
        variation: Variation,
        agent: Option<Agent>,
        shards: &[(Task, Range<u32>)],
    ) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let spec = spec(HIT, 0..1);
        let mut evaluation = Self {
            shards: Vec::new(),
            reports: Vec::new(),
            meta: EvaluationMeta {
                profile: spec.profile,
                seed: spec.seed,
                mismatch_seed: spec.mismatch_seed,
                agent: "test".into(),
                ruleset: faceoff_airhockey::RULESET,
                task_weights: faceoff_airhockey::competition().weights(&variation),
                tiers: faceoff_airhockey::competition().tiers,
                variation,
            },
            dir,
        };
        for (task, range) in shards {
            let out = evaluation
                .dir
                .path()
                .join(format!("{task}-{}", range.start));
            let spec = ShardSpec {
                perturbations: evaluation.meta.variation.perturbations.clone(),
                ..self::spec(*task, range.clone())
            };
            let report = play(&spec, agent, &out);
            evaluation.reports.push(report);
            evaluation.shards.push(out);
        }
        evaluation
    }

    pub fn assemble(&self, name: &str) -> Result<(AssembledDataset, PathBuf), RecordingError> {
        let archive = self.dir.path().join(name);
        assemble(
            &self.meta,
            &self.shards,
            &archive,
            None,
            simulator().as_ref(),
        )
        .map(|assembled| (assembled, archive))
    }

    /// Assembles `dataset.zip` and unpacks it to `dataset`.
    pub fn assembled(self) -> Self {
        self.assemble("dataset.zip").unwrap();
        unzip(&self.archive(), &self.folder());
        self
    }

    pub fn archive(&self) -> PathBuf {
        self.dir.path().join("dataset.zip")
    }

    pub fn folder(&self) -> PathBuf {
        self.dir.path().join("dataset")
    }
}

/// Unpacks an archive and returns the names of its files, in order.
pub fn unzip(archive: &Path, into: &Path) -> Vec<String> {
    let mut zip = ZipArchive::new(File::open(archive).unwrap()).unwrap();
    zip.extract(into).unwrap();
    (0..zip.len())
        .map(|i| zip.by_index(i).unwrap().name().unwrap().into_owned())
        .collect()
}

pub fn json<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The whole table, in one batch.
pub fn table(path: &Path) -> RecordBatch {
    let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let rows = builder.metadata().file_metadata().num_rows() as usize;
    let mut batches = builder.with_batch_size(rows).build().unwrap();
    let batch = batches.next().expect("a row").unwrap();
    assert_eq!(batch.num_rows(), rows);
    batch
}

/// Data of an earlier version: an archive, or a shard of a running evaluation.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/fixtures")
        .join(name)
}
