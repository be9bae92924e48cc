//! Verifies a dataset: simulates every episode again from the published seed, the ruleset and the
//! recorded actions, and compares every recorded number bit for bit; then scores again and compares
//! the published score.
//!
//! Computation times, CPU times, faults, the timing measurements of the slots (the places on workers where agents ran) and
//! the numbers of re-runs (episodes played again because other programs disturbed the host) cannot be simulated. They are
//! taken from the recording; values that follow from them are recomputed.

pub(crate) mod compare;
mod difference;
mod episode_reader;
mod error;
mod replay;
mod season;
mod shard;

pub use difference::Difference;
pub use error::VerifyError;
pub use season::{SeasonClaim, SeasonMismatch};
pub use shard::verify_shard;

use crate::{
    dataset::Dataset,
    error::DatasetError,
    files::{CALIBRATION_FILE, MANIFEST_FILE, RESULTS_FILE, VIOLATIONS_FILE},
    score::{ScoreRules, ScoredEvaluation, Tally, json_file, score},
    simulator::simulator_id,
};
use episode_reader::{EpisodeReader, RecordedEpisode};
use faceoff_episode::{Conditions, Simulator};
use faceoff_types::{Competition, EvaluationResult, Ruleset, RulesetInfo, Task, TaskMap};
use rayon::{
    ThreadPoolBuilder,
    iter::{IntoParallelRefIterator, ParallelIterator},
};
use replay::{ReplayedEpisode, Replayer};
use std::num::NonZero;

/// Episodes per thread that are read while others are simulated.
const READ_AHEAD_PER_THREAD: usize = 8;

/// A dataset that was verified: the simulation gives the same numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifiedDataset {
    pub episodes: u32,
    /// Control steps simulated again.
    pub steps: u64,
    /// The recomputed score.
    pub result: EvaluationResult,
}

/// Simulates a dataset again on `threads` threads; `progress` is called after each episode. The result does not depend
/// on the number of threads. Memory grows with the episodes, not with their steps.
///
/// # Errors
/// [`VerifyError::Differs`] with the first difference in order of task, episode and step, or the reason why the dataset
/// cannot be verified.
pub fn verify(
    dataset: &Dataset,
    simulator: &dyn Simulator,
    threads: NonZero<usize>,
    progress: &(dyn Fn() + Sync),
) -> Result<VerifiedDataset, VerifyError> {
    let ruleset = check_reproducible(dataset, simulator)?;
    let manifest = dataset.manifest();
    let competition = simulator.competition();
    let tasks = competition
        .tasks_in_order(&manifest.episodes)
        .map_err(|unknown| DatasetError::Foreign(format!("{MANIFEST_FILE}: {unknown}")))?;
    if let Some(weights) = &manifest.variation.weights {
        let checked = weights.in_order(competition.task_names());
        checked
            .map_err(|error| DatasetError::Foreign(format!("{MANIFEST_FILE}: weights: {error}")))?;
    }
    if manifest.variation.tier_bounds.is_some() && competition.tiers.is_none() {
        return Err(DatasetError::Foreign(format!(
            "{MANIFEST_FILE}: tier_bounds: the competition has no tiers"
        ))
        .into());
    }
    let mut reader = EpisodeReader::open(dataset, tasks.clone(), competition)?;
    let mut totals = Totals::new(dataset, &tasks, &reader.steps_of_tasks(), competition);
    let world_factory = simulator.world_factory(&Conditions {
        ruleset: ruleset.ruleset,
        profile: manifest.profile,
        perturbations: &manifest.variation.perturbations,
        seed: manifest.seed,
        mismatch_seed: manifest.mismatch_seed,
    });
    let world_factory = world_factory
        .map_err(|invalid| DatasetError::Foreign(format!("{MANIFEST_FILE}: {invalid}")))?;
    let replayer = Replayer::new(ruleset, world_factory, competition);
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads.get())
        .thread_name(|index| format!("verify-{index}"))
        .build()?;
    let batch_size = READ_AHEAD_PER_THREAD * threads.get();
    pool.install(|| {
        let mut batch = reader.next_episodes(batch_size);
        while !batch.episodes.is_empty() {
            let simulate = || -> Vec<Result<ReplayedEpisode, Difference>> {
                let replayed = batch.episodes.par_iter().map(|recorded| {
                    let replayed = replayer.episode(recorded);
                    progress();
                    replayed
                });
                replayed.collect()
            };
            let (replayed, next_batch) = match batch.result {
                Ok(()) => rayon::join(simulate, || reader.next_episodes(batch_size)),
                // Differences in the episodes before the reading error are reported first.
                Err(_) => (simulate(), episode_reader::EpisodeBatch::default()),
            };
            for (replayed, recorded) in replayed.into_iter().zip(&batch.episodes) {
                totals.add(recorded, replayed?);
            }
            batch.result?;
            batch = next_batch;
        }
        batch.result
    })?;
    totals.finish(ruleset.ruleset, dataset, competition)
}

/// Checks that this version can reproduce the states: same ruleset, same simulator, valid magnitudes.
fn check_reproducible(
    dataset: &Dataset,
    simulator: &dyn Simulator,
) -> Result<RulesetInfo, DatasetError> {
    let (manifest, current) = (dataset.manifest(), simulator_id(simulator));
    let competition = simulator.competition();
    let found = competition.find_ruleset(&manifest.ruleset);
    let ruleset = *found.map_err(|unknown| DatasetError::Foreign(unknown.to_string()))?;
    let mut magnitudes = manifest.variation.perturbations.clone();
    competition
        .check_magnitudes(&mut magnitudes)
        .map_err(|error| DatasetError::Foreign(format!("perturbations.{error}")))?;
    if manifest.simulator != current {
        return Err(DatasetError::Foreign(format!(
            "the dataset was simulated by version {} (fingerprint {}), this is version {} \
             (fingerprint {}): verify it with the version that made it",
            manifest.simulator.version,
            manifest.simulator.fingerprint,
            current.version,
            current.fingerprint
        )));
    }
    Ok(ruleset)
}

/// Sums over the episodes, in order of play.
struct Totals {
    episodes: u32,
    steps: u64,
    host_interference_reruns: u32,
    tallies: TaskMap<Tally>,
}

impl Totals {
    fn new(
        dataset: &Dataset,
        tasks: &[Task],
        steps: &TaskMap<u64>,
        competition: &Competition,
    ) -> Self {
        let tally = |task: &Task| {
            let steps = steps.get(task).copied().unwrap_or_default();
            (*task, Tally::new(steps, dataset.layout(), competition))
        };
        Self {
            episodes: 0,
            steps: 0,
            host_interference_reruns: 0,
            tallies: tasks.iter().map(tally).collect(),
        }
    }

    fn add(&mut self, recorded: &RecordedEpisode, replayed: ReplayedEpisode) {
        self.episodes += 1;
        self.steps += u64::from(replayed.outcome.steps);
        self.host_interference_reruns += replayed.host_interference_reruns;
        if let Some(tally) = self.tallies.get_mut(&recorded.task) {
            tally.add_steps(recorded.episode, &replayed.steps);
            tally.add_episode(replayed.outcome);
        }
    }

    fn finish(
        self,
        ruleset: Ruleset,
        dataset: &Dataset,
        competition: &Competition,
    ) -> Result<VerifiedDataset, VerifyError> {
        let manifest = dataset.manifest();
        let timing = dataset.calibration()?.worst();
        let recorded_reruns = timing.map_or(0, |timing| timing.host_interference_reruns);
        if recorded_reruns != self.host_interference_reruns {
            return Err(Difference {
                file: CALIBRATION_FILE,
                task: None,
                episode: None,
                rally: None,
                step: None,
                field: "host_noise_reruns".to_owned(),
                recorded: format!("{recorded_reruns} in total"),
                expected: format!(
                    "{}, the sum over the episodes",
                    self.host_interference_reruns
                ),
            }
            .into());
        }
        let weights = competition.weights(&manifest.variation);
        let rules = ScoreRules {
            competition,
            ruleset,
            profile: manifest.profile,
            variation: &manifest.variation,
            weights: &weights,
            bounds: competition.tier_bounds(&manifest.variation),
            seed: manifest.seed,
            layout: dataset.layout(),
        };
        let ScoredEvaluation { result, violations } = score(&rules, self.tallies, timing);
        for (name, expected) in [
            (VIOLATIONS_FILE, json_file(&violations)),
            (RESULTS_FILE, json_file(&result)),
        ] {
            let expected = expected.map_err(DatasetError::unreadable(name))?;
            if let Some(difference) =
                compare::json_difference(name, &dataset.bytes(name)?, &expected)
            {
                return Err(difference.into());
            }
        }
        Ok(VerifiedDataset {
            episodes: self.episodes,
            steps: self.steps,
            result,
        })
    }
}
