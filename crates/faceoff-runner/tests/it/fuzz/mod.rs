//! Fuzz tests with mutations of valid input: nothing may panic, nothing may be reported as a platform fault, and every kind of refusal
//! must occur. Each kind of input is a *target* with its own test. Tests run a fixed number of inputs; `make fuzz MINUTES=60` runs
//! longer.

mod answers;
mod archives;
mod datasets;
mod games;
mod images;
mod manifests;
mod mutation;
mod rng;

use rng::Rng;
use std::{
    collections::BTreeMap,
    env,
    time::{Duration, Instant},
};

/// Prints how to repeat the run if it panics.
struct RunGuard<'a> {
    target: &'a str,
    seed: u64,
    number: u64,
}

impl Drop for RunGuard<'_> {
    #[expect(clippy::print_stderr, reason = "a panic is about to be reported")]
    fn drop(&mut self) {
        if std::thread::panicking() {
            let Self {
                target,
                seed,
                number,
            } = self;
            eprintln!("fuzz target {target}: repeat with FUZZ_SEED={seed} FUZZ_RUN={number}");
        }
    }
}

/// The number in an environment variable, if it is set.
fn env_number(variable: &str) -> Option<u64> {
    let value = env::var(variable).ok()?;
    Some(value.parse().expect("a whole number"))
}

/// Runs a target, which returns the label of its outcome, and counts the labels. Each run depends only on the seed and
/// its number.
#[expect(clippy::print_stdout, reason = "a long run reports its outcomes")]
fn fuzz(
    target: &str,
    runs: u64,
    mut run_once: impl FnMut(&mut Rng) -> String,
) -> BTreeMap<String, u64> {
    let seed = env_number("FUZZ_SEED").unwrap_or(1);
    let minutes = env_number("FUZZ_MINUTES").map(|minutes| Duration::from_secs(60 * minutes));
    let started = Instant::now();
    let repeated_run = env_number("FUZZ_RUN");
    let mut outcomes = BTreeMap::new();
    let mut runs_done = 0;
    for number in repeated_run.unwrap_or(0).. {
        let is_done = match (repeated_run, minutes) {
            (Some(_), _) => runs_done == 1,
            (None, Some(minutes)) => started.elapsed() >= minutes && runs_done >= runs,
            (None, None) => runs_done >= runs,
        };
        if is_done {
            break;
        }
        let guard = RunGuard {
            target,
            seed,
            number,
        };
        *outcomes
            .entry(run_once(&mut Rng::new(target, seed, number)))
            .or_default() += 1;
        drop(guard);
        runs_done += 1;
    }
    println!("fuzz target {target}: {runs_done} runs with seed {seed}: {outcomes:#?}");
    outcomes
}

/// Asserts that every kind of outcome occurred; `FUZZ_RUN` repeats a single run, which is not checked.
#[track_caller]
fn assert_outcomes(outcomes: &BTreeMap<String, u64>, kinds: &[&str]) {
    if env_number("FUZZ_RUN").is_some() {
        return;
    }
    let missing: Vec<_> = kinds
        .iter()
        .filter(|kind| !outcomes.keys().any(|label| label.contains(*kind)))
        .collect();
    assert!(
        missing.is_empty(),
        "missing: {missing:?}, found: {outcomes:#?}"
    );
}
