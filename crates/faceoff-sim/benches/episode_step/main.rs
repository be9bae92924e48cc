//! Benchmark: compares episodes stepped at once, with SIMD instructions, with the same episodes stepped one by one. The arms hold still,
//! or follow recorded actions of `striker`, an agent of this repository. Prints control steps and physics steps per second of one core,
//! and the speed-up; then the speed of a batch of episodes on all cores.
//!
//! The variants alternate, and the least CPU time of each counts, so that other load has little effect. An argument
//! filters the rows: `cargo bench --bench episode_step -- held`.

#![expect(clippy::print_stdout, reason = "the benchmark prints a table")]

mod recorded;

use faceoff_sim::AirHockeyTask;
use faceoff_sim::{
    ActivePerturbations, Batch, BatchSetup, Interpolation, JOINTS, PerturbationSettings, Plant,
    SUBSTEPS, SimdLevel, model::INITIAL_Q,
};
use faceoff_types::Seed;
use recorded::{RecordedEpisode, ReplayingWorlds, hold_still, record_striker};
use rustix::time::{ClockId, clock_gettime};
use std::time::{Duration, Instant};

/// Episodes per row of the table, control steps of each in a round, and rounds (repetitions).
const WORLDS: usize = 16;
const STEPS: usize = 100;
const ROUNDS: usize = 20;

/// Episodes of the batch, and control steps of each in a round.
const BATCH_WORLDS: u32 = 256;
const BATCH_STEPS: usize = 20;

fn main() {
    let filter = std::env::args().nth(1).filter(|arg| !arg.starts_with("--"));
    let is_wanted = |name: &str| filter.as_ref().is_none_or(|filter| name.contains(filter));
    println!("control steps/s (physics steps/s) of one core; speed-up over one by one");
    for (profile, active_perturbations) in [
        ("ideal", ActivePerturbations::NONE),
        ("evaluation", ActivePerturbations::EVALUATION),
    ] {
        for task in AirHockeyTask::ALL {
            let name = format!("held/{task}/{profile}");
            if is_wanted(&name) {
                compare(
                    &name,
                    &hold_still(task, active_perturbations, STEPS as u32, WORLDS as u32),
                );
            }
            let name = format!("striker/{task}/{profile}");
            if is_wanted(&name) {
                compare(
                    &name,
                    &record_striker(task, active_perturbations, 2 * WORLDS as u32),
                );
            }
        }
    }
    if is_wanted("batch") {
        batch();
    }
}

/// Measures and prints one row: each variant steps the same episodes.
fn compare(name: &str, recorded: &[RecordedEpisode]) {
    let variants = [
        ("one by one", None),
        ("plain", Some(SimdLevel::PLAIN)),
        ("avx", SimdLevel::avx()),
    ];
    let mut least_times = [Duration::MAX; 3];
    for _ in 0..ROUNDS {
        for (least_time, (variant, simd_level)) in least_times.iter_mut().zip(variants) {
            if simd_level.is_none() && variant == "avx" {
                continue;
            }
            let mut worlds = ReplayingWorlds::new(recorded, WORLDS);
            let start = cpu_time();
            for _ in 0..STEPS {
                worlds.step(simd_level);
            }
            *least_time = (cpu_time() - start).min(*least_time);
        }
    }
    print!("{name:28}");
    for ((variant, _), time) in variants.into_iter().zip(least_times) {
        if time < Duration::MAX {
            print!(
                "  {variant} {} x{:.2}",
                rate(WORLDS * STEPS, time),
                least_times[0].as_secs_f64() / time.as_secs_f64()
            );
        }
    }
    println!();
}

/// Measures and prints the speed of a batch on one thread and on all threads, by wall time.
fn batch() {
    let held = Interpolation::Cubic.hold_position(&INITIAL_Q);
    let actions = held[..2 * JOINTS].repeat(BATCH_WORLDS as usize);
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let thread_counts = [1, all];
    let mut least_times = [Duration::MAX; 2];
    for _ in 0..ROUNDS {
        for (least_time, threads) in least_times.iter_mut().zip(thread_counts) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().expect("a machine that has threads");
            let mut batch = Batch::new(BatchSetup {
                task: AirHockeyTask::Prepare,
                interpolation: Interpolation::Cubic,
                active_perturbations: ActivePerturbations::NONE,
                settings: PerturbationSettings::default(),
                plant: Plant::nominal(),
                seed: Seed::from_number(0),
                worlds: BATCH_WORLDS,
            });
            let start = Instant::now();
            pool.install(|| {
                for _ in 0..BATCH_STEPS {
                    batch.step(&actions);
                }
            });
            *least_time = start.elapsed().min(*least_time);
        }
    }
    for (threads, time) in thread_counts.into_iter().zip(least_times) {
        println!(
            "batch of {BATCH_WORLDS}, prepare/ideal: {threads} threads {}",
            rate(BATCH_WORLDS as usize * BATCH_STEPS, time)
        );
    }
    let efficiency = least_times[0].as_secs_f64() / least_times[1].as_secs_f64() / all as f64;
    println!("throughput per thread with {all} threads: {efficiency:.2} of a single thread");
}

/// Text: control steps per second, and in parentheses physics steps per second.
fn rate(control_steps: usize, time: Duration) -> String {
    let per_s = control_steps as f64 / time.as_secs_f64();
    format!("{per_s:.0} ({:.0})", per_s * SUBSTEPS as f64)
}

/// Time that this thread has spent on a CPU.
fn cpu_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::try_from(time).expect("a time that has passed")
}
