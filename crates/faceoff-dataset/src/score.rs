//! Computes the score and the list of violations from the episodes of an evaluation.

use crate::{
    dataset::{FileRange, Layout, StepTable},
    error::{DatasetError, RecordingError},
    table::{CONSTRAINTS, HOST_TIME},
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
    ComputationTime, EpisodeEnd, EpisodeOutcome, EvaluationResult, Profile, Ruleset, Seed,
    SlotTiming, TaskMap, TaskWeights, TierBounds, Variation, Violations,
};
use faceoff_wire::dataset::{
    ConstraintViolation, SlowEpisode, SlowStep, TaskViolations, ViolationsFile,
};
use serde::Serialize;
use std::{collections::BTreeMap, path::Path};

/// Data of one answered step for scoring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepMeasurement {
    pub timing: AnswerTiming,
    /// How far each constraint is exceeded: joint position, joint velocity, end effector, link height. Violated if above 0.
    pub constraints: [f64; 4],
}

/// Collects the data of a task for scoring, in order of play.
#[derive(Debug)]
pub(crate) struct Tally {
    outcomes: Vec<EpisodeOutcome>,
    times: Times,
    /// Violations of each constraint, in the order of [`StepMeasurement::constraints`].
    violations: [Vec<ConstraintViolation>; 4],
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
    pub fn new(steps: u64, layout: Layout) -> Self {
        Self {
            outcomes: Vec::new(),
            times: match layout {
                Layout::Two => Times::Ascending(Vec::new()),
                Layout::Three | Layout::Four => Times::PlayOrder(StepTimes::for_steps(steps)),
            },
            violations: Default::default(),
            slowest: (layout == Layout::Four).then(BTreeMap::new),
        }
    }

    pub fn add_episode(&mut self, outcome: EpisodeOutcome) {
        self.outcomes.push(outcome);
    }

    pub fn add_step(&mut self, episode: u32, step: u32, measured: &StepMeasurement) {
        let AnswerTiming {
            computation_time_s,
            host_time_s,
            cpu_time_s,
        } = measured.timing;
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
        for (violations, value) in self.violations.iter_mut().zip(measured.constraints) {
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
    pub fn add_table(&mut self, path: &Path) -> Result<(), RecordingError> {
        let names = [
            "episode",
            "step",
            "computation_time_ns",
            HOST_TIME,
            "cpu_time_ns",
        ]
        .into_iter();
        let names: Vec<String> = names.chain(CONSTRAINTS).map(str::to_owned).collect();
        let recording_error = |error: DatasetError| match error {
            DatasetError::Io(error) => RecordingError::Io(error),
            other => RecordingError::unusable(path.display())(other),
        };
        let range = FileRange::whole(path).map_err(recording_error)?;
        let table = StepTable::open(range).map_err(recording_error)?;
        let mut batches = table.read(Some(&names)).map_err(recording_error)?;
        while let Some(batch) = batches.next_batch().map_err(recording_error)? {
            self.add_batch(&batch);
        }
        Ok(())
    }

    fn add_batch(&mut self, batch: &RecordBatch) {
        let episodes = batch["episode"].as_primitive::<UInt32Type>();
        let steps = batch["step"].as_primitive::<UInt32Type>();
        let [times, host_times, cpu_times] = ["computation_time_ns", HOST_TIME, "cpu_time_ns"]
            .map(|name| batch[name].as_primitive::<Int64Type>());
        let constraints = CONSTRAINTS.map(|name| batch[name].as_primitive::<Float64Type>());
        for row in 0..batch.num_rows() {
            let measured = StepMeasurement {
                timing: AnswerTiming {
                    computation_time_s: seconds(times.value(row)),
                    host_time_s: seconds(host_times.value(row)),
                    cpu_time_s: cpu_times
                        .is_valid(row)
                        .then(|| seconds(cpu_times.value(row))),
                },
                constraints: constraints.map(|column| column.value(row)),
            };
            self.add_step(episodes.value(row), steps.value(row), &measured);
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

/// Scores an evaluation; `layout` is the one that `violations.json` names.
#[expect(
    clippy::too_many_arguments,
    reason = "the rules of a score, one by one: a dataset and an evaluation have them in different places"
)]
pub(crate) fn score(
    ruleset: Ruleset,
    profile: Profile,
    variation: &Variation,
    weights: &TaskWeights,
    bounds: Option<TierBounds>,
    seed: Seed,
    layout: Layout,
    tallies: TaskMap<Tally>,
    timing: Option<SlotTiming>,
) -> ScoredEvaluation {
    let mut tasks = TaskMap::new();
    let mut violations = ViolationsFile {
        schema: layout.schema().to_owned(),
        tasks: TaskMap::new(),
    };
    for (task, tally) in tallies {
        let times = tally.times.finish();
        let result = faceoff_scoring::score_task(&tally.outcomes, &times, bounds);
        tasks.insert(task, result);
        let [joint_pos, joint_vel, ee, link] = tally.violations;
        let names = Violations::default().by_name().map(|(name, _)| name);
        let slowest = tally.slowest.unwrap_or_default();
        let computation_time = tally
            .outcomes
            .iter()
            .filter_map(|outcome| slow_episode(outcome, &slowest))
            .collect();
        violations.tasks.insert(
            task,
            TaskViolations {
                constraints: names
                    .into_iter()
                    .zip([ee, link, joint_pos, joint_vel])
                    .collect(),
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
    let points =
        faceoff_scoring::episode_penalty(outcome) - faceoff_scoring::episode_penalty(&instant);
    let ComputationTime { mean_s, max_s } = outcome.computation_time;
    (points > 0.0).then_some(SlowEpisode {
        episode: outcome.episode,
        mean_s,
        max_s,
        points,
        slowest: slowest.get(&outcome.episode).map(|(_, slow)| *slow),
    })
}
