//! Rows of `episodes.parquet`, the table with one row per episode.

use super::{
    columns::FloatColumns,
    steps::{observation_columns, put_observation},
};
use crate::{digest::StepDigests, error::RecordingError};
use arrow_array::{
    ArrayRef,
    builder::{ArrayBuilder, BooleanBuilder, StringBuilder, UInt32Builder},
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use faceoff_episode::{AirHockeyWorld, EpisodeStart, StepRow};
use faceoff_sim::EpisodeState;
use faceoff_types::EpisodeOutcome;
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
    violations: [BooleanBuilder; 4],
    /// Penalty points and computation times.
    times: FloatColumns,
    faults: StringBuilder,
    actions_blake3: StringBuilder,
    times_blake3: StringBuilder,
    host_noise_reruns: UInt32Builder,
    /// The true state before the first step.
    initial: FloatColumns,
    /// The observation after the last answered step.
    last: FloatColumns,
}

/// Values of an episode's row that are known at its start.
struct StartedEpisode {
    seed: String,
    interpolation: Option<String>,
    initial: EpisodeState,
}

impl EpisodeRows {
    pub fn new() -> Self {
        let times = FloatColumns::default().with(
            [
                "penalty_points",
                "computation_time_mean_s",
                "computation_time_max_s",
            ]
            .map(str::to_owned),
            false,
        );
        let initial = FloatColumns::default().with_state("initial_");
        let last = observation_columns("last_obs_", true);
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
            flag("violated_ee"),
            flag("violated_link"),
            flag("violated_joint_pos"),
            flag("violated_joint_vel"),
        ];
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
            violations: Default::default(),
            times,
            faults: StringBuilder::new(),
            actions_blake3: StringBuilder::new(),
            times_blake3: StringBuilder::new(),
            host_noise_reruns: UInt32Builder::new(),
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
    pub fn begin(&mut self, start: &EpisodeStart<'_, AirHockeyWorld>) {
        self.started = Some(StartedEpisode {
            seed: start.seed.to_string(),
            interpolation: start.choice.map(|code| code.to_string()),
            initial: start.state.clone(),
        });
        self.digests = StepDigests::default();
        self.last_observation.clear();
    }

    pub fn step(&mut self, row: &StepRow<'_, AirHockeyWorld>) {
        self.digests.add(row.action, &row.timing);
        self.last_observation.clear();
        self.last_observation
            .extend_from_slice(row.next_observation);
    }

    pub fn end(
        &mut self,
        outcome: &EpisodeOutcome,
        host_noise_reruns: u32,
    ) -> Result<(), RecordingError> {
        let started = self.started.take().ok_or_else(|| {
            RecordingError::Unusable("an episode ended without a start".to_owned())
        })?;
        self.seeds.append_value(started.seed);
        self.interpolations.append_option(started.interpolation);
        self.initial.put_state(&started.initial);
        self.initial.end_row();
        self.tasks.append_value(outcome.task.as_str());
        self.episodes.append_value(outcome.episode);
        self.steps.append_value(outcome.steps);
        self.ends.append_value(outcome.end.as_str());
        self.successes.append_value(outcome.success);
        let violations = outcome.violations;
        for (column, violated) in self.violations.iter_mut().zip([
            violations.ee,
            violations.link,
            violations.joint_pos,
            violations.joint_vel,
        ]) {
            column.append_value(violated);
        }
        self.times.put(&[
            faceoff_scoring::episode_penalty(outcome),
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
        self.host_noise_reruns.append_value(host_noise_reruns);
        put_observation(&mut self.last, &self.last_observation);
        self.last.end_row();
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
                .map(|column| Arc::new(column.finish()) as ArrayRef),
        );
        columns.extend(self.times.take());
        columns.push(Arc::new(self.faults.finish()));
        columns.push(Arc::new(self.actions_blake3.finish()));
        columns.push(Arc::new(self.times_blake3.finish()));
        columns.push(Arc::new(self.host_noise_reruns.finish()));
        columns.extend(self.initial.take());
        columns.extend(self.last.take());
        columns
    }
}
