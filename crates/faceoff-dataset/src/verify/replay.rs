//! Simulates a recorded episode again with its recorded actions, and compares every number with the recorded one. This is not the
//! replay that browsers show.

use super::{compare, difference::Difference, episode_reader::RecordedEpisode};
use crate::{
    dataset::Columns,
    files::{EPISODES_FILE, STEPS_FILE},
    score::Measurements,
    table::{EpisodeRows, HOST_INTERFERENCE, StepRows},
    times::seconds,
};
use arrow_array::{
    Array, Float64Array, Int64Array, ListArray, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type},
};
use faceoff_episode::{
    AnswerTiming, EpisodeStart, RecordError, RunningEpisode, StepRow, StepSink, WorldFactory,
};
use faceoff_types::{
    ActionLayout, ActionSpace, AgentFault, Competition, EpisodeOutcome, RulesetInfo,
};
use std::sync::Arc;

/// Simulates the episodes of an evaluation again.
pub(super) struct Replayer {
    ruleset: RulesetInfo,
    world_factory: Box<dyn WorldFactory>,
    competition: Arc<Competition>,
}

/// A replayed episode without differences.
pub(super) struct ReplayedEpisode {
    pub outcome: EpisodeOutcome,
    /// Data of the episode's steps for scoring.
    pub steps: Measurements,
    /// How often the episode was played again because other programs disturbed the host.
    pub host_interference_reruns: u32,
}

/// Replay of one episode with its recorded answers.
struct EpisodeReplay<'a> {
    recorded: &'a RecordedEpisode,
    ruleset: RulesetInfo,
    /// The layout of the agent's actions; `None` if it failed before it stated one, so that it has no steps.
    layout: Option<ActionLayout>,
    running: RunningEpisode<ReplayRows>,
}

/// The rows that the simulation gives, which the recording must equal.
struct ReplayRows {
    steps: StepRows,
    episodes: EpisodeRows,
    measured: Measurements,
}

impl StepSink for ReplayRows {
    fn begin(&mut self, start: EpisodeStart<'_>) {
        self.steps.begin(start.episode);
        self.episodes.begin(&start);
    }

    fn observe(&mut self, observation: &[f64]) {
        self.steps.observe(observation);
    }

    fn step(&mut self, row: &StepRow<'_>) {
        self.steps.push(row);
        self.episodes.step(row);
        self.measured.timings.push(row.timing);
        self.measured
            .constraint_values
            .extend_from_slice(row.world.constraint_values());
    }

    fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordError> {
        self.episodes
            .end(outcome, host_interference_reruns)
            .map_err(|error| RecordError {
                what: "the episode's row".to_owned(),
                source: error.into(),
            })
    }
}

/// Inputs from the agent that are read from the recording.
struct RecordedInputs {
    layout: Option<ActionLayout>,
    fault: Option<AgentFault>,
}

impl Replayer {
    pub fn new(
        ruleset: RulesetInfo,
        world_factory: Box<dyn WorldFactory>,
        competition: &Arc<Competition>,
    ) -> Self {
        Self {
            ruleset,
            world_factory,
            competition: competition.clone(),
        }
    }

    /// Simulates an episode again and compares all its numbers.
    pub fn episode(&self, recorded: &RecordedEpisode) -> Result<ReplayedEpisode, Difference> {
        let inputs = read_inputs(recorded, &self.competition.actions)?;
        let rows = ReplayRows {
            steps: StepRows::new(recorded.task, &self.competition.recording),
            episodes: EpisodeRows::new(&self.competition),
            measured: Measurements::default(),
        };
        let (task, episode) = (recorded.task, recorded.episode);
        let world_factory = self.world_factory.as_ref();
        let running = RunningEpisode::begin(world_factory, task, episode, inputs.layout, rows);
        let running = running.map_err(|unknown| {
            row_difference(
                recorded,
                "task",
                recorded.task.as_str(),
                unknown.to_string(),
            )
        })?;
        let mut replay = EpisodeReplay {
            recorded,
            ruleset: self.ruleset,
            layout: inputs.layout,
            running,
        };
        let mut outcome = None;
        for batch in &recorded.steps {
            outcome = replay.replay_batch(batch)?.or(outcome);
        }
        replay.end(outcome, inputs.fault)
    }
}

impl EpisodeReplay<'_> {
    /// Applies the actions of some steps and compares the resulting rows. Returns the outcome if the episode ended.
    fn replay_batch(&mut self, batch: &RecordBatch) -> Result<Option<EpisodeOutcome>, Difference> {
        let first = self.running.steps();
        let mut outcome = None;
        let error = (0..batch.num_rows()).find_map(|row| match self.step(batch, row) {
            Ok(step_outcome) => {
                outcome = step_outcome.or(outcome.take());
                None
            }
            Err(difference) => Some(difference),
        });
        let steps = &mut self.running.sink().steps;
        let simulated = RecordBatch::try_new(steps.schema().clone(), steps.take())
            .expect("the rows are built by their own schema");
        // A difference before the error is reported first.
        if let Some(cell) = compare::first_row_difference(batch, &simulated) {
            let step = first.saturating_add(u32::try_from(cell.row).unwrap_or(u32::MAX));
            return Err(self.step_difference(step, &cell.field, cell.recorded, cell.expected));
        }
        error.map_or(Ok(outcome), Err)
    }

    fn step(
        &mut self,
        batch: &RecordBatch,
        row: usize,
    ) -> Result<Option<EpisodeOutcome>, Difference> {
        let step = self.running.steps();
        if let Some(end) = self.running.end() {
            let expected = format!("no more steps: the episode has ended ({})", end.as_str());
            return Err(self.step_difference(step, "step", "another step".to_owned(), expected));
        }
        let Some(layout) = self.layout else {
            let expected = "no steps: the agent had not started".to_owned();
            return Err(self.step_difference(step, "step", "a step".to_owned(), expected));
        };
        let action = self.read_action(batch, row, step, layout.len())?;
        let timing = self.read_timing(batch, row, step)?;
        // The running episode stores a divergence; the recorded fault must match it.
        Ok(self
            .running
            .answer(action.values(), timing)
            .unwrap_or_default())
    }

    /// The recorded action, checked, since it is an input of the simulation.
    fn read_action(
        &self,
        batch: &RecordBatch,
        row: usize,
        step: u32,
        len: usize,
    ) -> Result<Float64Array, Difference> {
        let actions: &ListArray = batch["action"].as_list();
        let wrong = |recorded: String| {
            let limit = self.ruleset.action_limit;
            let expected = if limit == f64::MAX {
                format!("{len} finite numbers")
            } else {
                format!("{len} numbers of at most {limit} in magnitude")
            };
            self.step_difference(step, "action", recorded, expected)
        };
        if actions.is_null(row) {
            return Err(wrong("nothing".to_owned()));
        }
        let values = actions.value(row);
        let action: &Float64Array = values.as_primitive::<Float64Type>();
        if action.len() != len || action.null_count() > 0 {
            return Err(wrong(format!(
                "{} numbers",
                action.len() - action.null_count()
            )));
        }
        let limit = self.ruleset.action_limit;
        let allowed = |number: &&f64| number.abs() <= limit;
        match action.values().iter().find(|number| !allowed(number)) {
            Some(number) => Err(wrong(format!("{number:?}"))),
            None => Ok(action.clone()),
        }
    }

    /// The recorded times, checked.
    fn read_timing(
        &self,
        batch: &RecordBatch,
        row: usize,
        step: u32,
    ) -> Result<AnswerTiming, Difference> {
        let time = |name: &str| -> Result<Option<i64>, Difference> {
            let column: &Int64Array = batch[name].as_primitive::<Int64Type>();
            if column.is_null(row) {
                return Ok(None);
            }
            match column.value(row) {
                negative @ ..0 => Err(self.step_difference(
                    step,
                    name,
                    negative.to_string(),
                    "at least 0".to_owned(),
                )),
                time => Ok(Some(time)),
            }
        };
        let name = "computation_time_ns";
        let Some(computation_time) = time(name)? else {
            return Err(self.step_difference(
                step,
                name,
                "nothing".to_owned(),
                "a time".to_owned(),
            ));
        };
        Ok(AnswerTiming {
            computation_time_s: seconds(computation_time),
            host_time_s: time(HOST_INTERFERENCE)?.map(seconds).unwrap_or_default(),
            cpu_time_s: time("cpu_time_ns")?.map(seconds),
        })
    }

    /// Determines the outcome from the replay and the recorded fault, and compares the episode's row.
    fn end(
        mut self,
        simulated_outcome: Option<EpisodeOutcome>,
        fault: Option<AgentFault>,
    ) -> Result<ReplayedEpisode, Difference> {
        let (recorded, steps) = (self.recorded, self.running.steps());
        let diverged = self.running.diverged().map(ToString::to_string);
        let outcome = match (simulated_outcome, fault) {
            (Some(outcome), None) => outcome,
            (None, Some(fault)) => {
                let recorded_fault = fault.to_string();
                self.running
                    .outcome_after_recorded_fault(fault)
                    .ok_or_else(|| {
                        let expected = diverged.unwrap_or_else(|| {
                            format!("a fault of this episode after {steps} steps")
                        });
                        row_difference(recorded, "fault", recorded_fault, expected)
                    })?
            }
            (Some(outcome), Some(fault)) => {
                let end = outcome.end.as_str();
                let expected = format!("none: the episode ended before ({end})");
                return Err(row_difference(
                    recorded,
                    "fault",
                    fault.to_string(),
                    expected,
                ));
            }
            (None, None) => {
                if let Some(expected) = diverged {
                    return Err(row_difference(recorded, "fault", "nothing", expected));
                }
                let expected = "more: the episode has not ended".to_owned();
                return Err(row_difference(
                    recorded,
                    "steps",
                    steps.to_string(),
                    expected,
                ));
            }
        };
        // The number of re-runs cannot be simulated.
        let reruns = Columns(&recorded.row).int("host_noise_reruns", 0);
        let host_interference_reruns = reruns.unwrap_or_default();
        let rows = self.running.sink();
        if let Err(error) = rows.end(&outcome, host_interference_reruns) {
            return Err(row_difference(
                recorded,
                "fault",
                error.to_string(),
                "a fault",
            ));
        }
        let simulated = RecordBatch::try_new(rows.episodes.schema().clone(), rows.episodes.take())
            .expect("the row is built by its own schema");
        match compare::first_row_difference(&recorded.row, &simulated) {
            None => Ok(ReplayedEpisode {
                outcome,
                steps: std::mem::take(&mut rows.measured),
                host_interference_reruns,
            }),
            Some(cell) => Err(row_difference(
                recorded,
                &cell.field,
                cell.recorded,
                cell.expected,
            )),
        }
    }

    fn step_difference(
        &self,
        step: u32,
        field: &str,
        recorded: String,
        expected: String,
    ) -> Difference {
        Difference {
            file: STEPS_FILE,
            task: Some(self.recorded.task),
            episode: Some(self.recorded.episode),
            rally: None,
            step: Some(step),
            field: field.to_owned(),
            recorded,
            expected,
        }
    }
}

/// Reads the layout of the agent's actions and its fault from the episode's row.
fn read_inputs(
    recorded: &RecordedEpisode,
    actions: &ActionSpace,
) -> Result<RecordedInputs, Difference> {
    let columns = Columns(&recorded.row);
    let fault = columns
        .text("fault", 0)
        .map(serde_json::from_str::<AgentFault>)
        .transpose()
        .map_err(|error| row_difference(recorded, "fault", error.to_string(), "a fault as JSON"))?;
    // Only a fault at the agent's start names no episode.
    let started = fault.as_ref().is_none_or(|fault| fault.episode.is_some());
    let text = columns.text("interpolation", 0);
    let wrong = |expected: &str| {
        let text = text.unwrap_or("nothing");
        row_difference(recorded, "interpolation", text, expected)
    };
    let layout = match (text, actions.only_layout()) {
        (None, only) => only.filter(|_| started),
        (Some(_), Some(_)) => return Err(wrong("nothing: agents do not state it")),
        (Some(text), None) => {
            let expected = || wrong(&actions.codes_text());
            Some(actions.parse(text).ok_or_else(expected)?)
        }
    };
    if started != layout.is_some() {
        return Err(wrong(if started {
            "the agent's interpolation: the agent had started"
        } else {
            "nothing: the agent had not started"
        }));
    }
    Ok(RecordedInputs { layout, fault })
}

fn row_difference(
    recorded: &RecordedEpisode,
    field: &str,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Difference {
    let RecordedEpisode { task, episode, .. } = recorded;
    Difference {
        file: EPISODES_FILE,
        task: Some(*task),
        episode: Some(*episode),
        rally: None,
        step: None,
        field: field.to_owned(),
        recorded: found.into(),
        expected: expected.into(),
    }
}
