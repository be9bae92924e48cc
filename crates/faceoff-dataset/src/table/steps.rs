//! Rows of `steps.parquet`, the table with one row per answered control step.

use super::columns::{FloatColumns, joints};
use crate::times::nanoseconds;
use arrow_array::{
    ArrayRef, Int64Array, RecordBatch, StringArray,
    builder::{Float64Builder, Int64Builder, ListBuilder, UInt32Builder},
};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};
use faceoff_episode::{AirHockeyWorld, StepRow};
use faceoff_types::Task;
use std::sync::Arc;

/// Length of the longest observation, which includes the position of an opponent.
const MAX_OBSERVATION_NUMBERS: usize = 23;

/// Columns of an observation in the protocol's order, with names after `prefix`; absent numbers are null.
pub(super) fn observation_columns(prefix: &str, nullable: bool) -> FloatColumns {
    FloatColumns::default()
        .with(
            ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| format!("{prefix}puck_{c}")),
            nullable,
        )
        .with(joints(&format!("{prefix}q")), nullable)
        .with(joints(&format!("{prefix}dq")), nullable)
        .with(
            ["x", "y", "z"].map(|c| format!("{prefix}opponent_ee_{c}")),
            true,
        )
}

/// Appends an observation to its columns; an empty observation gives nulls.
pub(super) fn put_observation(columns: &mut FloatColumns, observation: &[f64]) {
    columns.put(observation);
    columns.put_absent(MAX_OBSERVATION_NUMBERS - observation.len());
}

/// Rows of the table of control steps: one per answered step.
pub(crate) struct StepRows {
    schema: SchemaRef,
    task: Task,
    episode: u32,
    episodes: UInt32Builder,
    steps: UInt32Builder,
    observations: FloatColumns,
    actions: ListBuilder<Float64Builder>,
    computation_times: Int64Builder,
    host_times: Int64Builder,
    cpu_times: Int64Builder,
    state_and_constraints: FloatColumns,
}

impl StepRows {
    pub fn new(task: Task) -> Self {
        let observations = observation_columns("obs_", false);
        let state_and_constraints = FloatColumns::default()
            .with_state("")
            .with(CONSTRAINTS.map(str::to_owned), false);
        let item = Arc::new(Field::new_list_field(DataType::Float64, false));
        let mut fields = vec![
            Field::new("task", DataType::Utf8, false),
            Field::new("episode", DataType::UInt32, false),
            Field::new("step", DataType::UInt32, false),
        ];
        fields.extend_from_slice(observations.fields());
        fields.push(Field::new("action", DataType::List(item.clone()), false));
        fields.push(Field::new(COMPUTATION_TIME, DataType::Int64, false));
        fields.push(Field::new(HOST_TIME, DataType::Int64, false));
        fields.push(Field::new("cpu_time_ns", DataType::Int64, true));
        fields.extend_from_slice(state_and_constraints.fields());
        Self {
            schema: Arc::new(Schema::new(fields)),
            task,
            episode: 0,
            episodes: UInt32Builder::new(),
            steps: UInt32Builder::new(),
            observations,
            actions: ListBuilder::new(Float64Builder::new()).with_field(item),
            computation_times: Int64Builder::new(),
            host_times: Int64Builder::new(),
            cpu_times: Int64Builder::new(),
            state_and_constraints,
        }
    }

    /// The columns' names and types.
    pub const fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    /// Begins an episode; rows of one that has not ended are dropped.
    pub fn begin(&mut self, episode: u32) {
        self.episode = episode;
        if !self.steps.values_slice().is_empty() {
            self.episodes.finish();
            self.steps.finish();
            self.observations.take();
            self.actions.finish();
            self.computation_times.finish();
            self.host_times.finish();
            self.cpu_times.finish();
            self.state_and_constraints.take();
        }
    }

    pub fn observe(&mut self, observation: &[f64]) {
        put_observation(&mut self.observations, observation);
        self.observations.end_row();
    }

    pub fn push(&mut self, row: &StepRow<'_, AirHockeyWorld>) {
        self.episodes.append_value(self.episode);
        self.steps.append_value(row.step);
        self.actions.values().append_slice(row.action);
        self.actions.append(true);
        self.computation_times
            .append_value(nanoseconds(row.timing.computation_time_s));
        self.host_times
            .append_value(nanoseconds(row.timing.host_time_s));
        self.cpu_times
            .append_option(row.timing.cpu_time_s.map(nanoseconds));
        let state_and_constraints = &mut self.state_and_constraints;
        state_and_constraints.put_state(row.world.state);
        let constraints = row.world.constraints;
        state_and_constraints.put(&[
            constraints.joint_pos,
            constraints.joint_vel,
            constraints.ee,
            constraints.link,
        ]);
        state_and_constraints.end_row();
    }

    /// Removes and returns the rows so far.
    pub fn take(&mut self) -> Vec<ArrayRef> {
        let episodes = self.episodes.finish();
        let tasks =
            StringArray::from_iter_values(std::iter::repeat_n(self.task.as_str(), episodes.len()));
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(tasks),
            Arc::new(episodes),
            Arc::new(self.steps.finish()),
        ];
        columns.extend(self.observations.take());
        columns.push(Arc::new(self.actions.finish()));
        columns.push(Arc::new(self.computation_times.finish()));
        columns.push(Arc::new(self.host_times.finish()));
        columns.push(Arc::new(self.cpu_times.finish()));
        columns.extend(self.state_and_constraints.take());
        columns
    }
}

/// Column of computation times, ns.
const COMPUTATION_TIME: &str = "computation_time_ns";
/// Column of host interference, ns: time that other programs on the evaluator's machine took. It exists since layout 4.
pub(crate) const HOST_TIME: &str = "host_time_ns";

/// Adds the column for host interference to the schema of an earlier layout's table of control steps.
pub(crate) fn schema_with_host_time(schema: &Schema) -> Schema {
    let mut fields = schema.fields().to_vec();
    let field = Arc::new(Field::new(HOST_TIME, DataType::Int64, false));
    fields.insert(host_time_index(schema), field);
    Schema::new_with_metadata(fields, schema.metadata().clone())
}

/// Adds the column for host interference to rows of an earlier layout: 0, since it was not recorded.
pub(crate) fn with_zero_host_time(batch: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let mut columns = batch.columns().to_vec();
    let zeros = Int64Array::from_value(0, batch.num_rows());
    columns.insert(host_time_index(&batch.schema()), Arc::new(zeros));
    RecordBatch::try_new(Arc::new(schema_with_host_time(&batch.schema())), columns)
}

/// Index of the column for host interference: after the computation time.
fn host_time_index(schema: &Schema) -> usize {
    let times = schema.column_with_name(COMPUTATION_TIME);
    times.map_or(schema.fields().len(), |(index, _)| index + 1)
}

/// Columns of the constraint values, in their order in the table. A constraint is violated if its value is above 0.
pub(crate) const CONSTRAINTS: [&str; 4] = [
    "constraint_joint_pos",
    "constraint_joint_vel",
    "constraint_ee",
    "constraint_link",
];
