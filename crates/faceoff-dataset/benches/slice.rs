//! Measures reading one episode (a slice of the dataset) from an archive of about 300 MB, as a replay page does. The archive
//! is opened for each reading; only the operating system has its bytes in the cache.
#![expect(clippy::unwrap_used, reason = "a benchmark may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use faceoff_airhockey::{EVALUATION, PREPARE, TASKS};
use faceoff_dataset::{Dataset, Recorder, ShardFolder, ShardReport, assemble};
use faceoff_episode::{AirHockeyStep, AnswerTiming, EpisodeStart, StepRow, StepSink};
use faceoff_sim::{AirHockeyProfile, Episode, Interpolation, PerturbationSettings, Plant};
use faceoff_types::{ComputationTime, EpisodeEnd, EpisodeOutcome, Ruleset, Seed, Violations};
use faceoff_wire::job::{EvaluationMeta, ShardSpec};
use std::{hint::black_box, path::Path};

const EPISODES: u32 = 1000;
const EPISODES_PER_SHARD: u32 = 100;
/// Control steps of each episode.
const STEPS: u32 = 230;

/// A number that rarely repeats, like a measurement.
fn noise(number: f64) -> f64 {
    (number * 1e3 + 0.37).sin()
}

/// Records a shard of noise in the folder `out`.
fn record(spec: &ShardSpec, out: &Path) {
    let folder = ShardFolder::create(out).unwrap();
    let mut recorder = Recorder::create(&folder, spec.task).unwrap();
    let (settings, plant) = (PerturbationSettings::default(), Plant::nominal());
    let mut outcomes = Vec::new();
    for episode in spec.episodes.clone() {
        let seed = spec.seed.episode(spec.task, episode);
        let (cubic, factors) = (
            Interpolation::Cubic,
            AirHockeyProfile::try_from(spec.profile).unwrap().factors(),
        );
        let simulation = Episode::new(
            spec.task.try_into().unwrap(),
            cubic,
            factors,
            &settings,
            &plant,
            seed,
        );
        let (mut state, mut observation) = (simulation.state(), simulation.observation().to_vec());
        recorder.begin(EpisodeStart {
            episode,
            seed,
            choice: Some(Interpolation::Cubic),
            state: &state,
        });
        for step in 0..STEPS {
            observation
                .iter_mut()
                .for_each(|number| *number = noise(*number));
            recorder.observe(&observation);
            state.puck = state.puck.map(noise);
            state.q = state.q.map(noise);
            state.dq = state.dq.map(noise);
            state.ee = state.ee.map(noise);
            recorder.step(&StepRow {
                step,
                action: &[state.q, state.dq].concat(),
                timing: AnswerTiming {
                    computation_time_s: 1e-3,
                    host_time_s: 0.0,
                    cpu_time_s: Some(5e-4),
                },
                next_observation: &observation,
                world: AirHockeyStep {
                    state: &state,
                    constraints: Default::default(),
                    puck_lost: false,
                    impacts: &[],
                },
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
    folder.commit(spec, &report).unwrap();
}

fn slice(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let seed = Seed::from_number(1);
    let mut shards = Vec::new();
    for task in TASKS {
        for start in (0..EPISODES).step_by(EPISODES_PER_SHARD as usize) {
            let spec = ShardSpec {
                ruleset: Ruleset::CURRENT,
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
        ruleset: Ruleset::CURRENT,
        variation: Default::default(),
        task_weights: faceoff_airhockey::competition().weights(&Default::default()),
    };
    let archive = dir.path().join("dataset.zip");
    let megabytes = assemble(&meta, &shards, &archive, None)
        .unwrap()
        .archive
        .bytes
        / 1_000_000;
    let read = |columns: Option<&[String]>| {
        let dataset = Dataset::open_lazily(&archive).unwrap();
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
