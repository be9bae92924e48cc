//! The evaluator for a policy, a Python function from an observation to an action: it runs the episodes of an evaluation
//! as the server does, and scores them.

use crate::{
    actions::{ActionFormat, ActionMode},
    errors::{OrderError, argument_error, catch_panic, check_perturbations, simulator_error},
};
use faceoff_airhockey::SimulationSetup;
use faceoff_airhockey::{TASKS, competition};
use faceoff_episode::{AnswerTiming, NullSink, RunningEpisode};
use faceoff_scoring::{StepTimes, score_evaluation, score_task};
use faceoff_sim::{AirHockeyProfile, AirHockeyTask};
use faceoff_sim::{
    AirHockeyRuleset, Interpolation, JOINTS, PerturbationSettings, model::INITIAL_Q,
};
use faceoff_types::{EpisodeOutcome, Phase, Profile, Seed, Task, TaskMap, TaskResult, Variation};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

/// No time is measured: the policy runs in this process, not in an agent's.
const UNTIMED: AnswerTiming = AnswerTiming {
    computation_time_s: 0.0,
    host_time_s: 0.0,
    cpu_time_s: None,
};

/// State shared by all episodes of an evaluation.
#[pyclass(frozen, module = "faceoff._native")]
pub struct Evaluation {
    /// Ruleset, perturbations, and the simulated arm of all episodes.
    setup: SimulationSetup,
    profile: Profile,
    seed: Seed,
    /// Settings that differ from the ruleset's.
    variation: Variation,
}

#[pymethods]
impl Evaluation {
    /// `profile` names a set of perturbations, `seed` is as on the command line. `mismatch_seed`, from which the arm's
    /// deviation from its model follows, is derived from `seed` if absent.
    /// `perturbations` are magnitudes in JSON.
    #[new]
    fn new(
        py: Python<'_>,
        profile: &str,
        seed: &str,
        mismatch_seed: Option<&str>,
        perturbations: &str,
    ) -> PyResult<Self> {
        let profile: AirHockeyProfile = profile
            .parse()
            .map_err(|error| argument_error("profile", "a profile", error))?;
        let parse_seed = |name, text: &str| -> PyResult<Seed> {
            text.parse()
                .map_err(|error: faceoff_types::ParseSeedError| {
                    argument_error(name, "a seed", error)
                })
        };
        let seed = parse_seed("seed", seed)?;
        let mismatch_seed = match mismatch_seed {
            Some(text) => parse_seed("mismatch_seed", text)?,
            None => seed.model_mismatch(),
        };
        let settings: PerturbationSettings =
            serde_json::from_str(perturbations).map_err(|error| {
                argument_error("perturbations", "magnitudes of perturbations", error)
            })?;
        let magnitudes = check_perturbations(&settings)?;
        let setup = py.detach(|| {
            catch_panic(|| {
                let ruleset = AirHockeyRuleset::CURRENT;
                Ok(SimulationSetup::with_ruleset(
                    ruleset,
                    profile,
                    &settings,
                    seed,
                    mismatch_seed,
                ))
            })
        })?;
        Ok(Self {
            setup,
            profile: profile.name(),
            seed,
            variation: Variation {
                perturbations: magnitudes,
                ..Variation::default()
            },
        })
    }

    /// Begins an episode for a policy with this interpolation and action format.
    fn begin(
        &self,
        task: &str,
        episode: u32,
        interpolation: Option<i64>,
        action_mode: &str,
        clip_actions: bool,
    ) -> PyResult<PolicyEpisode> {
        let interpolation = Interpolation::from_code(interpolation).map_err(|error| {
            argument_error("interpolation", "1, 2, 3, 4, 5, -1 or None", error.0)
        })?;
        let mode = match action_mode {
            "delta" => ActionMode::Delta,
            "absolute" => ActionMode::Absolute,
            "raw" => ActionMode::Raw,
            other => {
                return Err(argument_error(
                    "action_mode",
                    "delta, absolute or raw",
                    other,
                ));
            }
        };
        let action_format = ActionFormat {
            mode,
            interpolation,
            clip: clip_actions,
        };
        let task = parse_task(task)?;
        let running = catch_panic(|| {
            let layout = Some(interpolation.into());
            let begun = RunningEpisode::begin(&self.setup, task, episode, layout, NullSink);
            begun.map_err(|error| simulator_error(&error.to_string()))
        })?;
        Ok(PolicyEpisode {
            running,
            action_format,
            commanded: INITIAL_Q,
            command: vec![0.0; action_format.len()],
            is_over: false,
        })
    }

    /// Scores outcomes, each as JSON and in any order; returns the content of `results.json`.
    fn score(&self, outcomes: Vec<String>) -> PyResult<String> {
        let mut by_task: TaskMap<Vec<EpisodeOutcome>> =
            TASKS.into_iter().map(|task| (task, Vec::new())).collect();
        for outcome in &outcomes {
            let outcome: EpisodeOutcome = serde_json::from_str(outcome)
                .map_err(|error| argument_error("outcomes", "outcomes of episodes", error))?;
            let task = parse_task(outcome.task.as_str())?;
            by_task.entry(task).or_default().push(outcome);
        }
        let competition = competition();
        let tier_bounds = competition.tier_bounds(&self.variation);
        let result = catch_panic(|| {
            let tasks: TaskMap<TaskResult> = by_task
                .into_iter()
                .filter(|(_, outcomes)| !outcomes.is_empty())
                .map(|(task, mut outcomes)| {
                    outcomes.sort_unstable_by_key(|outcome| outcome.episode);
                    let steps = outcomes.iter().map(|outcome| u64::from(outcome.steps));
                    let steps: u64 = steps.sum();
                    let mut times = StepTimes::for_steps(steps);
                    // The policy was not timed, so each step counts as 0 s.
                    (0..steps).for_each(|_| times.add(0.0));
                    (
                        task,
                        score_task(&competition, &outcomes, &times, tier_bounds),
                    )
                })
                .collect();
            let ruleset = faceoff_airhockey::RULESET;
            Ok(score_evaluation(
                ruleset,
                self.profile,
                self.seed,
                &self.variation,
                &competition.weights(&self.variation),
                tier_bounds,
                tasks,
            ))
        })?;
        serde_json::to_string(&result).map_err(|error| simulator_error(&error.to_string()))
    }
}

/// A running episode of a policy.
#[pyclass(module = "faceoff._native")]
pub struct PolicyEpisode {
    running: RunningEpisode<NullSink>,
    action_format: ActionFormat,
    /// Last commanded joint positions, rad.
    commanded: [f64; JOINTS],
    /// The command of the current step; its memory is reused.
    command: Vec<f64>,
    is_over: bool,
}

#[pymethods]
impl PolicyEpisode {
    /// The observation of the protocol: 23 numbers with an opponent on the table, 20 without.
    fn observation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let request = self
            .running
            .action_request()
            .map_err(|error| simulator_error(&error.to_string()))?;
        Ok(PyArray1::from_slice(py, request.observation))
    }

    /// Runs a control step with the policy's action. Returns the outcome as JSON at the episode's end.
    fn answer(
        &mut self,
        py: Python<'_>,
        action: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Option<String>> {
        if self.is_over {
            return Err(OrderError::new_err(
                "expected an episode under way, got one that has ended",
            ));
        }
        let action = action.as_slice()?;
        if action.len() != self.action_format.len() {
            let expected = format!("{} numbers", self.action_format.len());
            return Err(argument_error("action", expected, action.len()));
        }
        self.action_format.check(action, |_| String::new())?;
        let Self {
            running,
            action_format,
            commanded,
            command,
            ..
        } = self;
        action_format.command(action, commanded, command);
        let outcome = py.detach(|| {
            catch_panic(|| {
                Ok(match running.answer(command, UNTIMED) {
                    Ok(outcome) => outcome,
                    Err(fault) => Some(running.outcome_after_fault(Phase::Step, fault, None)),
                })
            })
        });
        self.is_over = !matches!(outcome, Ok(None));
        outcome?
            .map(|outcome| serde_json::to_string(&outcome))
            .transpose()
            .map_err(|error| simulator_error(&error.to_string()))
    }
}

fn parse_task(name: &str) -> PyResult<Task> {
    let task: Result<AirHockeyTask, _> = name.parse();
    task.map(AirHockeyTask::name)
        .map_err(|_| argument_error("task", "hit, defend or prepare", name))
}
