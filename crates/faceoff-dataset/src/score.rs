//! Computes the score and the list of violations from the episodes of an evaluation.

use crate::{
    dataset::{FileRange, Layout, StepTable},
    error::{DatasetError, RecordingError},
    table::{HOST_INTERFERENCE, constraint_columns},
    times::seconds,
};
use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type, UInt32Type},
};
use faceoff_episode::AnswerTiming;
use faceoff_scoring::StepTimes;
use faceoff_types::{
    Competition, ComputationTime, EpisodeEnd, EpisodeOutcome, EvaluationResult, Profile, Ruleset,
    Seed, SlotTiming, TaskMap, TaskWeights, TierBounds, Variation, ViolationName,
};
use faceoff_wire::dataset::{
    ConstraintViolation, SlowEpisode, SlowStep, TaskViolations, ViolationsFile,
};
use serde::Serialize;
use std::{collections::BTreeMap, path::Path, sync::Arc};

/// Data of an episode's steps for scoring.
#[derive(Debug, Default)]
pub(crate) struct Measurements {
    pub timings: Vec<AnswerTiming>,
    /// How far each limit is exceeded, step by step, in the order of the recording's columns. Violated if above 0.
    pub constraint_values: Vec<f64>,
}

/// Collects the data of a task for its score and for `violations.json`, in order of play.
#[derive(Debug)]
pub(crate) struct Tally {
    outcomes: Vec<EpisodeOutcome>,
    times: Times,
    /// The violations of each limit, in the order of the recording's columns.
    violations: Vec<(ViolationName, Vec<ConstraintViolation>)>,
    /// By number of episode: computation time (s) and step of the slowest answer. `None` for layouts that do not record
    /// host interference, the time that other programs on the evaluator's machine took.
    slowest: Option<BTreeMap<u32, (f64, SlowStep)>>,
}

/// Computation times, in the sequence in which they are summed: the mean then has the published bits.
#[derive(Debug)]
enum Times {
    PlayOrder(StepTimes),
    /// Times in s, for layout 2, whose mean was summed in ascending order.
    Ascending(Vec<f64>),
}

impl Tally {
    /// A tally of a task whose episodes have `steps` steps in total.
    pub fn new(steps: u64, layout: Layout, competition: &Competition) -> Self {
        let limits = competition.recording.limits.iter();
        Self {
            outcomes: Vec::new(),
            times: match layout {
                Layout::Two => Times::Ascending(Vec::new()),
                Layout::Three | Layout::Four => Times::PlayOrder(StepTimes::for_steps(steps)),
            },
            violations: limits.map(|name| (*name, Vec::new())).collect(),
            slowest: (layout == Layout::Four).then(BTreeMap::new),
        }
    }

    pub fn add_episode(&mut self, outcome: EpisodeOutcome) {
        self.outcomes.push(outcome);
    }

    /// Adds the steps of an episode.
    pub fn add_steps(&mut self, episode: u32, measured: &Measurements) {
        let count = self.violations.len();
        for (step, timing) in measured.timings.iter().enumerate() {
            let constraint_values = &measured.constraint_values[step * count..][..count];
            let step = u32::try_from(step).unwrap_or(u32::MAX);
            self.add_step(episode, step, *timing, constraint_values);
        }
    }

    fn add_step(
        &mut self,
        episode: u32,
        step: u32,
        timing: AnswerTiming,
        constraint_values: &[f64],
    ) {
        let AnswerTiming {
            computation_time_s,
            host_time_s,
            cpu_time_s,
        } = timing;
        match &mut self.times {
            Times::PlayOrder(times) => times.add(computation_time_s),
            Times::Ascending(times) => times.push(computation_time_s),
        }
        if let Some(slowest) = &mut self.slowest
            && slowest
                .get(&episode)
                .is_none_or(|(slowest_s, _)| computation_time_s > *slowest_s)
        {
            let slow = SlowStep {
                step,
                wall_s: computation_time_s + host_time_s,
                host_s: host_time_s,
                cpu_s: cpu_time_s,
            };
            slowest.insert(episode, (computation_time_s, slow));
        }
        for ((_, violations), &value) in self.violations.iter_mut().zip(constraint_values) {
            if value.is_nan() || value <= 0.0 {
                continue;
            }
            match violations.last_mut() {
                Some(last) if last.episode == episode => {
                    last.steps += 1;
                    last.max = last.max.max(value);
                }
                _ => violations.push(ConstraintViolation {
                    episode,
                    first_step: step,
                    steps: 1,
                    max: value,
                }),
            }
        }
    }

    /// Adds the steps of a shard's table.
    pub fn add_table(
        &mut self,
        path: &Path,
        competition: &Arc<Competition>,
    ) -> Result<(), RecordingError> {
        let constraints = constraint_columns(&competition.recording);
        let names = [
            "episode",
            "step",
            "computation_time_ns",
            HOST_INTERFERENCE,
            "cpu_time_ns",
        ]
        .into_iter();
        let names: Vec<String> = names
            .map(str::to_owned)
            .chain(constraints.iter().cloned())
            .collect();
        let recording_error = |error: DatasetError| match error {
            DatasetError::Io(error) => RecordingError::Io(error),
            other => RecordingError::unusable(path.display())(other),
        };
        let range = FileRange::whole(path).map_err(recording_error)?;
        let table = StepTable::open(range, competition).map_err(recording_error)?;
        let mut batches = table.read(Some(&names)).map_err(recording_error)?;
        while let Some(batch) = batches.next_batch().map_err(recording_error)? {
            self.add_batch(&batch, &constraints);
        }
        Ok(())
    }

    fn add_batch(&mut self, batch: &RecordBatch, constraints: &[String]) {
        let episodes = batch["episode"].as_primitive::<UInt32Type>();
        let steps = batch["step"].as_primitive::<UInt32Type>();
        let [times, host_interferences, cpu_times] =
            ["computation_time_ns", HOST_INTERFERENCE, "cpu_time_ns"]
                .map(|name| batch[name].as_primitive::<Int64Type>());
        let constraints: Vec<_> = constraints
            .iter()
            .map(|name| batch[name.as_str()].as_primitive::<Float64Type>())
            .collect();
        let mut constraint_values = Vec::with_capacity(constraints.len());
        for row in 0..batch.num_rows() {
            let timing = AnswerTiming {
                computation_time_s: seconds(times.value(row)),
                host_time_s: seconds(host_interferences.value(row)),
                cpu_time_s: cpu_times
                    .is_valid(row)
                    .then(|| seconds(cpu_times.value(row))),
            };
            constraint_values.clear();
            constraint_values.extend(constraints.iter().map(|column| column.value(row)));
            let (episode, step) = (episodes.value(row), steps.value(row));
            self.add_step(episode, step, timing, &constraint_values);
        }
    }

    /// Number of added steps.
    pub fn steps(&self) -> u64 {
        match &self.times {
            Times::PlayOrder(times) => times.count(),
            Times::Ascending(times) => times.len() as u64,
        }
    }
}

impl Times {
    fn finish(self) -> StepTimes {
        match self {
            Self::PlayOrder(times) => times,
            Self::Ascending(mut times) => {
                times.sort_unstable_by(f64::total_cmp);
                let mut summary = StepTimes::for_steps(times.len() as u64);
                times.into_iter().for_each(|time_s| summary.add(time_s));
                summary
            }
        }
    }
}

pub(crate) struct ScoredEvaluation {
    pub result: EvaluationResult,
    pub violations: ViolationsFile,
}

/// What a score depends on besides the episodes. For a new dataset it comes from the evaluation, for verification from the
/// dataset's manifest.
pub(crate) struct ScoreRules<'a> {
    pub competition: &'a Competition,
    pub ruleset: Ruleset,
    pub profile: Profile,
    pub variation: &'a Variation,
    pub weights: &'a TaskWeights,
    /// Bounds of the tiers; `None` in a competition without tiers.
    pub bounds: Option<TierBounds>,
    pub seed: Seed,
    /// The layout that `violations.json` names.
    pub layout: Layout,
}

/// Scores an evaluation.
pub(crate) fn score(
    rules: &ScoreRules<'_>,
    tallies: TaskMap<Tally>,
    timing: Option<SlotTiming>,
) -> ScoredEvaluation {
    let ScoreRules {
        competition,
        ruleset,
        profile,
        variation,
        weights,
        bounds,
        seed,
        layout,
    } = *rules;
    let mut tasks = TaskMap::new();
    let mut violations = ViolationsFile {
        schema: layout.schema().to_owned(),
        tasks: TaskMap::new(),
    };
    for (task, tally) in tallies {
        let times = tally.times.finish();
        let result = faceoff_scoring::score_task(competition, &tally.outcomes, &times, bounds);
        tasks.insert(task, result);
        let mut found = tally.violations;
        let mut constraints_of = |name: ViolationName| {
            let index = found.iter().position(|(other, _)| *other == name);
            (
                name,
                index.map_or_else(Vec::new, |index| found.swap_remove(index).1),
            )
        };
        let constraints = competition.world_violations().map(&mut constraints_of);
        let constraints = constraints.collect();
        let slowest = tally.slowest.unwrap_or_default();
        let computation_time = tally
            .outcomes
            .iter()
            .filter_map(|outcome| slow_episode(competition, outcome, &slowest))
            .collect();
        violations.tasks.insert(
            task,
            TaskViolations {
                constraints,
                computation_time,
            },
        );
    }
    let mut result = faceoff_scoring::score_evaluation(
        ruleset, profile, seed, variation, weights, bounds, tasks,
    );
    result.timing = timing;
    ScoredEvaluation { result, violations }
}

/// The bytes of a JSON file of a dataset, which are the same for the same value.
pub(crate) fn json_file<T: Serialize>(value: &T) -> serde_json::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The episode as `violations.json` lists it, if it has penalty points for computation time.
fn slow_episode(
    competition: &Competition,
    outcome: &EpisodeOutcome,
    slowest: &BTreeMap<u32, (f64, SlowStep)>,
) -> Option<SlowEpisode> {
    // The scoring crate defines the rule: the points are the difference to an agent that answers instantly.
    let instant = EpisodeOutcome {
        computation_time: ComputationTime::default(),
        end: EpisodeEnd::HORIZON,
        fault: None,
        ..outcome.clone()
    };
    let points = faceoff_scoring::episode_penalty(competition, outcome)
        - faceoff_scoring::episode_penalty(competition, &instant);
    let ComputationTime { mean_s, max_s } = outcome.computation_time;
    (points > 0.0).then_some(SlowEpisode {
        episode: outcome.episode,
        mean_s,
        max_s,
        points,
        slowest: slowest.get(&outcome.episode).map(|(_, slow)| *slow),
    })
}
