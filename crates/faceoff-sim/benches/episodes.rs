//! Benchmark: control steps per second while the arms hold their position, in single episodes, in a game, and in many episodes at once.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Batch, BatchSetup, Command, Episode, Game, GameSetup, Interpolation,
    JOINTS, PerturbationSettings, Plant, model::INITIAL_Q,
};
use faceoff_types::Seed;
use std::hint::black_box;

/// Control steps of one measured run.
const STEPS: u64 = 50;

/// Control steps of single episodes, with and without perturbations.
fn episode(c: &mut Criterion) {
    let mut hold = [0.0; 2 * JOINTS];
    hold[..JOINTS].copy_from_slice(&INITIAL_Q);
    let settings = PerturbationSettings::default();
    let mut group = c.benchmark_group("control_step");
    group.throughput(Throughput::Elements(STEPS));
    for (name, active_perturbations) in [
        ("ideal", ActivePerturbations::NONE),
        ("evaluation", ActivePerturbations::EVALUATION),
    ] {
        let plant = Plant::for_perturbations(active_perturbations, &settings, Seed::from_number(0));
        for task in AirHockeyTask::ALL {
            let episode = Episode::new(
                task,
                Interpolation::Cubic,
                active_perturbations,
                &settings,
                &plant,
                Seed::from_number(0).episode(task, 0),
            );
            group.bench_function(format!("{task}/{name}"), |b| {
                b.iter_batched_ref(
                    || episode.clone(),
                    |episode| {
                        for _ in 0..STEPS {
                            black_box(episode.step(black_box(&hold)));
                        }
                    },
                    criterion::BatchSize::SmallInput,
                );
            });
        }
    }
    group.finish();
}

/// A control step of a game.
fn game(c: &mut Criterion) {
    let hold = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let mut game = Game::new(GameSetup {
        interpolation: [Interpolation::Cubic; 2],
        active_perturbations: ActivePerturbations::NONE,
        settings: PerturbationSettings::default(),
        plant: Plant::nominal(),
        seed: Seed::from_number(0),
    });
    let mut group = c.benchmark_group("game");
    group.throughput(Throughput::Elements(1));
    group.bench_function("ideal", |b| {
        b.iter(|| black_box(game.step([Command::Act(black_box(&hold[..2 * JOINTS])); 2])));
    });
    group.finish();
}

/// A control step of a batch (many episodes at once), on one thread and on all.
fn batch(c: &mut Criterion) {
    const WORLDS: u32 = 64;
    let hold = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let actions = hold[..2 * JOINTS].repeat(WORLDS as usize);
    let mut group = c.benchmark_group("batch_of_64");
    group.throughput(Throughput::Elements(u64::from(WORLDS)));
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    for threads in [1, all] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let Ok(pool) = pool else { continue };
        let mut batch = Batch::new(BatchSetup {
            task: AirHockeyTask::Prepare,
            interpolation: Interpolation::Cubic,
            active_perturbations: ActivePerturbations::NONE,
            settings: PerturbationSettings::default(),
            plant: Plant::nominal(),
            seed: Seed::from_number(0),
            worlds: WORLDS,
        });
        group.bench_function(format!("prepare/{threads} threads"), |b| {
            b.iter(|| {
                pool.install(|| {
                    black_box(batch.step(black_box(&actions)));
                });
            });
        });
    }
    group.finish();
}

criterion_group!(benches, episode, game, batch);
criterion_main!(benches);
