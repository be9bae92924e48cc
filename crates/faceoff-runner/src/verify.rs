//! Verifies a dataset: simulates every episode again from the published seed, the ruleset and the
//! recorded actions, and compares every recorded number bit for bit; then scores again and compares
//! the published score.
//!
//! Computation times, CPU times, faults, the slots' calibration and re-runs cannot be simulated.
//! They are taken from the record, as they are; what follows from them is computed again.

mod compare;
mod difference;
mod feed;
mod replay;
mod season;

pub use difference::Difference;
pub use season::{SeasonClaim, SeasonMismatch};

use crate::{
    assemble::{Scored, json_file, score},
    dataset::{Dataset, DatasetError},
    recording::{CALIBRATION_FILE, RESULTS_FILE, StepScan, VIOLATIONS_FILE},
    simulator::simulator_id,
};
use faceoff_types::{EpisodeOutcome, EvaluationResult, Task};
use feed::Feed;
use replay::{Replay, Replayed};
use std::{
    collections::BTreeMap,
    num::NonZero,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, sync_channel},
    },
    thread,
};

/// What was found to be identical.
#[derive(Debug, Clone, PartialEq)]
pub struct Verified {
    /// Episodes simulated again.
    pub episodes: u32,
    /// Control steps simulated again.
    pub steps: u64,
    /// The score, computed again.
    pub result: EvaluationResult,
}

/// Why a dataset is not verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// It cannot be read, or not simulated by this version.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The first number that is not what the simulation gives.
    #[error("{0}")]
    Differs(Box<Difference>),
    /// A thread could not be started.
    #[error("starting a worker: {0}")]
    Worker(std::io::Error),
}

impl From<Difference> for VerifyError {
    fn from(difference: Difference) -> Self {
        Self::Differs(Box::new(difference))
    }
}

/// An episode to be simulated again.
struct Job {
    index: usize,
    recorded: feed::Recorded,
}

/// Simulates a dataset again on `workers` threads; `progress` is called after each episode. What is
/// found does not depend on the number of threads; memory is bounded by a few episodes per thread and
/// the episodes' table.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference in order of task, episode and step; else why
/// nothing could be compared.
pub fn verify(
    dataset: &Dataset,
    workers: NonZero<usize>,
    progress: &(dyn Fn() + Sync),
) -> Result<Verified, VerifyError> {
    let manifest = dataset.manifest();
    let here = simulator_id();
    if &manifest.simulator != here {
        return Err(DatasetError::Foreign(format!(
            "the dataset was simulated by version {} (fingerprint {}), this is version {} \
             (fingerprint {}): verify it with the version that made it",
            manifest.simulator.version,
            manifest.simulator.fingerprint,
            here.version,
            here.fingerprint
        ))
        .into());
    }
    let mut feed = Feed::open(dataset)?;
    let replay = Replay::new(manifest);
    let stop = AtomicBool::new(false);
    let (send, receive) = sync_channel::<Job>(2 * workers.get());
    let receive = Arc::new(Mutex::new(receive));
    let (fed, replayed) = thread::scope(|scope| {
        let (replay, stop) = (&replay, &stop);
        let threads = (0..workers.get())
            .map(|index| {
                let receive = receive.clone();
                thread::Builder::new()
                    .name(format!("verify-{index}"))
                    .spawn_scoped(scope, move || work(&receive, replay, stop, progress))
            })
            .collect::<Vec<_>>();
        // The workers alone hold the receiver: should all of them panic, sending ends, too.
        drop(receive);
        let fed = if threads.iter().any(Result::is_ok) {
            hand_out(&mut feed, send, stop)
        } else {
            drop(send);
            Ok(())
        };
        let mut replayed = Vec::new();
        let mut failed = None;
        for thread in threads {
            match thread {
                Ok(thread) => replayed.extend(
                    thread
                        .join()
                        .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
                ),
                Err(error) => failed = Some(error),
            }
        }
        match failed {
            Some(error) => (Err(VerifyError::Worker(error)), replayed),
            None => (fed, replayed),
        }
    });
    finish(dataset, fed, replayed)
}

/// Hands episode after episode to the workers, until all are read or one differs.
fn hand_out(
    feed: &mut Feed<'_>,
    send: std::sync::mpsc::SyncSender<Job>,
    stop: &AtomicBool,
) -> Result<(), VerifyError> {
    let mut index = 0;
    while !stop.load(Ordering::Relaxed) {
        let Some(recorded) = feed.next_episode()? else {
            break;
        };
        if send.send(Job { index, recorded }).is_err() {
            break;
        }
        index += 1;
    }
    Ok(())
}

fn work(
    jobs: &Mutex<Receiver<Job>>,
    replay: &Replay,
    stop: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Vec<(usize, Result<Replayed, Difference>)> {
    let mut done = Vec::new();
    loop {
        let job = jobs.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(Job { index, recorded }) = job else {
            return done;
        };
        let replayed = replay.episode(&recorded);
        if replayed.is_err() {
            stop.store(true, Ordering::Relaxed);
        }
        done.push((index, replayed));
        progress();
    }
}

/// The first difference of all; without one, the score again.
fn finish(
    dataset: &Dataset,
    fed: Result<(), VerifyError>,
    mut replayed: Vec<(usize, Result<Replayed, Difference>)>,
) -> Result<Verified, VerifyError> {
    // Episodes were handed out in order: whatever comes before the first difference was simulated.
    replayed.sort_by_key(|(index, _)| *index);
    let (mut episodes, mut steps, mut reruns) = (0, 0, 0);
    let mut played: BTreeMap<Task, (Vec<EpisodeOutcome>, StepScan)> = dataset
        .manifest()
        .episodes
        .keys()
        .map(|task| (*task, Default::default()))
        .collect();
    for (_, result) in replayed {
        let Replayed {
            outcome,
            scan,
            host_noise_reruns,
        } = result?;
        episodes += 1;
        reruns += host_noise_reruns;
        steps += u64::from(outcome.steps);
        let (outcomes, all) = played.entry(outcome.task).or_default();
        outcomes.push(outcome);
        all.append(scan);
    }
    fed?;
    let manifest = dataset.manifest();
    let timing = dataset.calibration()?.worst();
    let counted = timing.map_or(0, |timing| timing.host_noise_reruns);
    if counted != reruns {
        return Err(Difference {
            file: CALIBRATION_FILE.to_owned(),
            task: None,
            episode: None,
            step: None,
            field: "host_noise_reruns".to_owned(),
            recorded: format!("{counted} in all"),
            expected: format!("{reruns}, as the episodes say"),
        }
        .into());
    }
    let Scored { result, violations } = score(manifest.profile, manifest.seed, played, timing);
    let bytes = |name, json: Result<Vec<u8>, crate::PlatformFault>| {
        json.map_err(DatasetError::unreadable(format!("scoring {name} again")))
    };
    for (name, expected) in [
        (
            VIOLATIONS_FILE,
            bytes(VIOLATIONS_FILE, json_file(VIOLATIONS_FILE, &violations))?,
        ),
        (
            RESULTS_FILE,
            bytes(RESULTS_FILE, json_file(RESULTS_FILE, &result))?,
        ),
    ] {
        if let Some(difference) = compare::json(name, &dataset.bytes(name)?, &expected) {
            return Err(difference.into());
        }
    }
    Ok(Verified {
        episodes,
        steps,
        result,
    })
}
