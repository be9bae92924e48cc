//! What strangers send, mutated from what is valid: nothing may panic, none of it may be our fault, and
//! every kind of refusal is met. A fixed number of runs with every test, as long as one likes with
//! `make fuzz MINUTES=60`.

mod answers;
mod archives;
mod datasets;
mod draws;
mod games;
mod images;
mod manifests;
mod mutation;

use draws::Draws;
use std::{
    collections::BTreeMap,
    env,
    time::{Duration, Instant},
};

/// Says how to have a failed run again.
struct Run<'a> {
    target: &'a str,
    seed: u64,
    number: u64,
}

impl Drop for Run<'_> {
    #[expect(clippy::print_stderr, reason = "a panic is about to be reported")]
    fn drop(&mut self) {
        if std::thread::panicking() {
            let Self {
                target,
                seed,
                number,
            } = self;
            eprintln!("fuzz target {target}: again with FUZZ_SEED={seed} FUZZ_RUN={number}");
        }
    }
}

fn number(variable: &str) -> Option<u64> {
    let value = env::var(variable).ok()?;
    Some(value.parse().expect("a whole number"))
}

/// Runs a target that says what came of it, and counts what was said. Each run depends on the seed and
/// its number alone.
#[expect(clippy::print_stdout, reason = "an hour's run tells what it met")]
fn fuzz(
    target: &str,
    runs: u64,
    mut once: impl FnMut(&mut Draws) -> String,
) -> BTreeMap<String, u64> {
    let seed = number("FUZZ_SEED").unwrap_or(1);
    let minutes = number("FUZZ_MINUTES").map(|minutes| Duration::from_secs(60 * minutes));
    let started = Instant::now();
    let first = number("FUZZ_RUN");
    let mut met = BTreeMap::new();
    let mut played = 0;
    for number in first.unwrap_or(0).. {
        let over = match (first, minutes) {
            (Some(_), _) => played == 1,
            (None, Some(minutes)) => started.elapsed() >= minutes && played >= runs,
            (None, None) => played >= runs,
        };
        if over {
            break;
        }
        let run = Run {
            target,
            seed,
            number,
        };
        *met.entry(once(&mut Draws::of(target, seed, number)))
            .or_default() += 1;
        drop(run);
        played += 1;
    }
    println!("fuzz target {target}: {played} runs with seed {seed}: {met:#?}");
    met
}

/// Every kind was met. (One run that is had again meets one.)
#[track_caller]
fn assert_met(met: &BTreeMap<String, u64>, kinds: &[&str]) {
    if number("FUZZ_RUN").is_some() {
        return;
    }
    let missed: Vec<_> = kinds
        .iter()
        .filter(|kind| !met.keys().any(|label| label.contains(*kind)))
        .collect();
    assert!(missed.is_empty(), "never met: {missed:?}, but {met:#?}");
}
