//! Measures reading one episode (a slice of the dataset) from an archive of about 300 MB, as a replay page does. The archive
//! is opened for each reading; only the operating system has its bytes in the cache.
#![expect(clippy::unwrap_used, reason = "a benchmark may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use faceoff_airhockey::{EVALUATION, PREPARE, TASKS, simulator};
use faceoff_dataset::{Dataset, Recorder, ShardFolder, ShardReport, assemble};
use faceoff_episode::{AnswerTiming, EpisodeStart, StateColumns, StepRow, StepSink, World};
use faceoff_sim::Interpolation;
use faceoff_types::{ComputationTime, EpisodeEnd, EpisodeOutcome, Seed, Violations};
use faceoff_wire::job::{EvaluationMeta, ShardSpec};
use std::{any::Any, hint::black_box, path::Path};

const EPISODES: u32 = 1000;
const EPISODES_PER_SHARD: u32 = 100;
/// Control steps of each episode.
const STEPS: u32 = 230;

/// A world whose numbers rarely repeat, so that they compress as badly as measurements.
struct NoisyWorld {
    /// Observation, state and limits.
    numbers: Vec<f64>,
}

/// Numbers of an observation.
const OBSERVED: usize = 20;
/// Numbers of a state that are in every row.
const STATE: usize = 25;
/// Numbers of a state in episodes with an opponent.
const OPPONENT: usize = 10;

impl NoisyWorld {
    fn new() -> Self {
        let numbers = (0..OBSERVED + STATE + 4).map(|index| f64::from(index as u32));
        let mut world = Self {
            numbers: numbers.collect(),
        };
        world.step(&[]);
        world
    }
}

impl World for NoisyWorld {
    fn steps(&self) -> u32 {
        0
    }
    fn observation(&self) -> &[f64] {
        &self.numbers[..OBSERVED]
    }
    fn step(&mut self, _: &[f64]) -> Option<EpisodeEnd> {
        for number in &mut self.numbers {
            *number = (*number * 1e3 + 0.37).sin();
        }
        None
    }
    fn divergence(&self) -> Option<String> {
        None
    }
    fn success(&self) -> bool {
        false
    }
    fn violations(&self) -> Violations {
        Violations::default()
    }
    fn record_state(&self, columns: &mut dyn StateColumns) {
        columns.put(&self.numbers[OBSERVED..][..STATE]);
        columns.put_absent(OPPONENT);
    }
    fn constraint_values(&self) -> &[f64] {
        &self.numbers[OBSERVED + STATE..]
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// Records a shard of noise in the folder `out`.
fn record(spec: &ShardSpec, out: &Path) {
    let folder = ShardFolder::create(out).unwrap();
    let mut recorder = Recorder::create(&folder, spec.task, simulator().competition()).unwrap();
    let mut outcomes = Vec::new();
    for episode in spec.episodes.clone() {
        let mut world = NoisyWorld::new();
        recorder.begin(EpisodeStart {
            episode,
            seed: spec.seed.episode(spec.task, episode),
            layout: Some(Interpolation::Cubic.into()),
            world: &world,
        });
        for step in 0..STEPS {
            recorder.observe(world.observation());
            world.step(&[]);
            recorder.step(&StepRow {
                step,
                action: &world.numbers[..14],
                timing: AnswerTiming {
                    computation_time_s: 1e-3,
                    host_time_s: 0.0,
                    cpu_time_s: Some(5e-4),
                },
                next_observation: world.observation(),
                world: &world,
            });
        }
        let outcome = EpisodeOutcome {
            task: spec.task,
            episode,
            steps: STEPS,
            end: EpisodeEnd::HORIZON,
            success: false,
            violations: Violations::default(),
            computation_time: ComputationTime::default(),
            fault: None,
        };
        recorder.end(&outcome, 0).unwrap();
        outcomes.push(outcome);
    }
    recorder.finish().unwrap();
    let report = ShardReport {
        outcomes,
        log: String::new(),
        stopped_by_faults: false,
        timing: Default::default(),
    };
    folder.commit(spec, &report, simulator().as_ref()).unwrap();
}

fn slice(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let seed = Seed::from_number(1);
    let mut shards = Vec::new();
    for task in TASKS {
        for start in (0..EPISODES).step_by(EPISODES_PER_SHARD as usize) {
            let spec = ShardSpec {
                ruleset: faceoff_airhockey::RULESET,
                platform_retries: 0,
                task,
                episodes: start..start + EPISODES_PER_SHARD,
                profile: EVALUATION,
                seed,
                mismatch_seed: seed,
                max_faults: 0,
                perturbations: Default::default(),
            };
            let out = dir.path().join(format!("{task}-{start}"));
            record(&spec, &out);
            shards.push(out);
        }
    }
    let meta = EvaluationMeta {
        profile: EVALUATION,
        seed,
        mismatch_seed: seed,
        agent: "noise".to_owned(),
        ruleset: faceoff_airhockey::RULESET,
        variation: Default::default(),
        task_weights: faceoff_airhockey::competition().weights(&Default::default()),
        tiers: faceoff_airhockey::competition().tiers,
    };
    let archive = dir.path().join("dataset.zip");
    let megabytes = assemble(&meta, &shards, &archive, None, simulator().as_ref())
        .unwrap()
        .archive
        .bytes
        / 1_000_000;
    let read = |columns: Option<&[String]>| {
        let dataset = Dataset::open_lazily(&archive, simulator().competition()).unwrap();
        dataset.episode(PREPARE, 777, columns).unwrap()
    };
    let mut group = criterion.benchmark_group(format!("an episode of {megabytes} MB"));
    group.bench_function("all columns", |bencher| {
        bencher.iter(|| black_box(read(None)));
    });
    let puck_position = ["puck_x", "puck_y"].map(str::to_owned);
    group.bench_function("two columns", |bencher| {
        bencher.iter(|| black_box(read(Some(&puck_position))));
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = slice
}
criterion_main!(benches);
