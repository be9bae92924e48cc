//! Rows of `episodes.parquet`, the table with one row per episode.

use super::columns::{FloatColumns, StateValues};
use crate::{digest::StepDigests, error::RecordingError};
use arrow_array::{
    ArrayRef,
    builder::{ArrayBuilder, BooleanBuilder, StringBuilder, UInt32Builder},
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use faceoff_episode::{EpisodeStart, StateColumns, StepRow};
use faceoff_types::{Competition, EpisodeOutcome, ViolationName};
use std::sync::Arc;

/// Rows of the table of episodes.
pub(crate) struct EpisodeRows {
    schema: SchemaRef,
    digests: StepDigests,
    /// The observation after the last answered step; empty before the first.
    last_observation: Vec<f64>,
    /// Start of the current episode.
    started: Option<StartedEpisode>,
    tasks: StringBuilder,
    episodes: UInt32Builder,
    seeds: StringBuilder,
    interpolations: StringBuilder,
    steps: UInt32Builder,
    ends: StringBuilder,
    successes: BooleanBuilder,
    /// The kinds of violations that the world reports, and their columns.
    violations: Vec<(ViolationName, BooleanBuilder)>,
    competition: Arc<Competition>,
    /// Penalty points and computation times.
    times: FloatColumns,
    faults: StringBuilder,
    actions_blake3: StringBuilder,
    times_blake3: StringBuilder,
    host_interference_reruns: UInt32Builder,
    /// The true state before the first step.
    initial: FloatColumns,
    /// The observation after the last answered step.
    last: FloatColumns,
}

/// Values of an episode's row that are known at its start.
struct StartedEpisode {
    seed: String,
    interpolation: Option<String>,
    initial: Vec<Option<f64>>,
}

impl EpisodeRows {
    pub fn new(competition: &Arc<Competition>) -> Self {
        let recording = &competition.recording;
        let times = FloatColumns::default().with(
            [
                "penalty_points",
                "computation_time_mean_s",
                "computation_time_max_s",
            ]
            .map(str::to_owned),
            false,
        );
        let initial = FloatColumns::default().with_recorded("initial_", &recording.state, false);
        let last = FloatColumns::default().with_recorded("last_obs_", &recording.observation, true);
        let violations = competition.world_violations();
        let text = |name: &str, nullable| Field::new(name, DataType::Utf8, nullable);
        let flag = |name: &str| Field::new(name, DataType::Boolean, false);
        let mut fields = vec![
            text("task", false),
            Field::new("episode", DataType::UInt32, false),
            text("seed", false),
            text("interpolation", true),
            Field::new("steps", DataType::UInt32, false),
            text("end", false),
            flag("success"),
        ];
        fields.extend(
            violations
                .clone()
                .map(|name| flag(&format!("violated_{name}"))),
        );
        fields.extend_from_slice(times.fields());
        fields.push(text("fault", true));
        fields.push(text("actions_blake3", false));
        fields.push(text("times_blake3", false));
        fields.push(Field::new("host_noise_reruns", DataType::UInt32, false));
        fields.extend_from_slice(initial.fields());
        fields.extend_from_slice(last.fields());
        Self {
            schema: Arc::new(Schema::new(fields)),
            digests: StepDigests::default(),
            last_observation: Vec::new(),
            started: None,
            tasks: StringBuilder::new(),
            episodes: UInt32Builder::new(),
            seeds: StringBuilder::new(),
            interpolations: StringBuilder::new(),
            steps: UInt32Builder::new(),
            ends: StringBuilder::new(),
            successes: BooleanBuilder::new(),
            violations: violations
                .map(|name| (name, BooleanBuilder::new()))
                .collect(),
            competition: competition.clone(),
            times,
            faults: StringBuilder::new(),
            actions_blake3: StringBuilder::new(),
            times_blake3: StringBuilder::new(),
            host_interference_reruns: UInt32Builder::new(),
            initial,
            last,
        }
    }

    /// The columns' names and types.
    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    pub fn len(&self) -> usize {
        self.episodes.len()
    }

    /// Begins an episode; drops one that has not ended.
    pub fn begin(&mut self, start: &EpisodeStart<'_>) {
        let mut initial = StateValues::default();
        start.world.record_state(&mut initial);
        let stated = start
            .layout
            .filter(|_| self.competition.actions.agents_choose_layout);
        self.started = Some(StartedEpisode {
            seed: start.seed.to_string(),
            interpolation: stated.map(|layout| layout.to_string()),
            initial: initial.0,
        });
        self.digests = StepDigests::default();
        self.last_observation.clear();
    }

    pub fn step(&mut self, row: &StepRow<'_>) {
        self.digests.add(row.action, &row.timing);
        self.last_observation.clear();
        self.last_observation
            .extend_from_slice(row.next_observation);
    }

    pub fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_interference_reruns: u32,
    ) -> Result<(), RecordingError> {
        let started = self.started.take().ok_or_else(|| {
            RecordingError::Unusable("an episode ended without a start".to_owned())
        })?;
        self.seeds.append_value(started.seed);
        self.interpolations.append_option(started.interpolation);
        self.initial.put_optional(&started.initial);
        self.initial.end_row();
        self.tasks.append_value(outcome.task.as_str());
        self.episodes.append_value(outcome.episode);
        self.steps.append_value(outcome.steps);
        self.ends.append_value(outcome.end.as_str());
        self.successes.append_value(outcome.success);
        for (name, column) in &mut self.violations {
            column.append_value(outcome.violations.contains(*name));
        }
        self.times.put(&[
            faceoff_scoring::episode_penalty(&self.competition, outcome),
            outcome.computation_time.mean_s,
            outcome.computation_time.max_s,
        ]);
        self.times.end_row();
        let fault = outcome
            .fault
            .as_ref()
            .map(serde_json::to_string)
            .transpose()
            .map_err(RecordingError::unusable("writing a fault"))?;
        self.faults.append_option(fault);
        let [actions, times] = self.digests.finish();
        self.actions_blake3.append_value(actions);
        self.times_blake3.append_value(times);
        self.host_interference_reruns
            .append_value(host_interference_reruns);
        self.last.put(&self.last_observation);
        self.last.end_short_row();
        Ok(())
    }

    /// Removes and returns the rows so far.
    pub fn take(&mut self) -> Vec<ArrayRef> {
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(self.tasks.finish()),
            Arc::new(self.episodes.finish()),
            Arc::new(self.seeds.finish()),
            Arc::new(self.interpolations.finish()),
            Arc::new(self.steps.finish()),
            Arc::new(self.ends.finish()),
            Arc::new(self.successes.finish()),
        ];
        columns.extend(
            self.violations
                .iter_mut()
                .map(|(_, column)| Arc::new(column.finish()) as ArrayRef),
        );
        columns.extend(self.times.take());
        columns.push(Arc::new(self.faults.finish()));
        columns.push(Arc::new(self.actions_blake3.finish()));
        columns.push(Arc::new(self.times_blake3.finish()));
        columns.push(Arc::new(self.host_interference_reruns.finish()));
        columns.extend(self.initial.take());
        columns.extend(self.last.take());
        columns
    }
}
