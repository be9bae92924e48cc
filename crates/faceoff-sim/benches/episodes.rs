//! Control steps per second of a held arm, and of the parts of a substep.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use faceoff_sim::{
    Episode, Interpolation, JOINTS, PerturbationSettings, Plant, robot::model::INITIAL_Q,
};
use faceoff_types::{Factors, Seed, Task};
use std::hint::black_box;

/// Control steps of one sample.
const STEPS: u64 = 50;

fn held_arm(c: &mut Criterion) {
    let mut hold = [0.0; 2 * JOINTS];
    hold[..JOINTS].copy_from_slice(&INITIAL_Q);
    let settings = PerturbationSettings::default();
    let mut group = c.benchmark_group("control_step");
    group.throughput(Throughput::Elements(STEPS));
    for (name, factors) in [("ideal", Factors::NONE), ("evaluation", Factors::ALL)] {
        let plant = if factors == Factors::NONE {
            Plant::nominal()
        } else {
            Plant::mismatched(&settings, Seed::from_number(0))
        };
        for task in Task::ALL {
            let episode = Episode::new(
                task,
                Interpolation::Cubic,
                factors,
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

criterion_group!(benches, held_arm);
criterion_main!(benches);
