//! Rows of `steps.parquet`, the table with one row per answered control step.

use super::columns::FloatColumns;
use crate::times::nanoseconds;
use arrow_array::{
    ArrayRef, Int64Array, RecordBatch, StringArray,
    builder::{Float64Builder, Int64Builder, ListBuilder, UInt32Builder},
};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};
use faceoff_episode::{StateColumns, StepRow};
use faceoff_types::{RecordingColumns, Task};
use std::sync::Arc;

/// The columns of a competition's recordings: those of observations, and those of states and limits.
fn recorded_columns(recording: &RecordingColumns) -> [FloatColumns; 2] {
    let columns = FloatColumns::default;
    [
        columns().with_recorded("obs_", &recording.observation, false),
        columns()
            .with_recorded("", &recording.state, false)
            .with(constraint_columns(recording), false),
    ]
}

fn action_item() -> Field {
    Field::new_list_field(DataType::Float64, false)
}

/// The columns of the table and their types.
pub(crate) fn step_schema(recording: &RecordingColumns) -> Schema {
    let [observations, state_and_constraints] = recorded_columns(recording);
    let mut fields = vec![
        Field::new("task", DataType::Utf8, false),
        Field::new("episode", DataType::UInt32, false),
        Field::new("step", DataType::UInt32, false),
    ];
    fields.extend_from_slice(observations.fields());
    let action = DataType::List(Arc::new(action_item()));
    fields.push(Field::new("action", action, false));
    fields.push(Field::new(COMPUTATION_TIME, DataType::Int64, false));
    fields.push(Field::new(HOST_INTERFERENCE, DataType::Int64, false));
    fields.push(Field::new("cpu_time_ns", DataType::Int64, true));
    fields.extend_from_slice(state_and_constraints.fields());
    Schema::new(fields)
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
    host_interferences: Int64Builder,
    cpu_times: Int64Builder,
    state_and_constraints: FloatColumns,
}

impl StepRows {
    pub fn new(task: Task, recording: &RecordingColumns) -> Self {
        let [observations, state_and_constraints] = recorded_columns(recording);
        Self {
            schema: Arc::new(step_schema(recording)),
            task,
            episode: 0,
            episodes: UInt32Builder::new(),
            steps: UInt32Builder::new(),
            observations,
            actions: ListBuilder::new(Float64Builder::new()).with_field(action_item()),
            computation_times: Int64Builder::new(),
            host_interferences: Int64Builder::new(),
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
            self.host_interferences.finish();
            self.cpu_times.finish();
            self.state_and_constraints.take();
        }
    }

    pub fn observe(&mut self, observation: &[f64]) {
        self.observations.put(observation);
        self.observations.end_short_row();
    }

    pub fn push(&mut self, row: &StepRow<'_>) {
        self.episodes.append_value(self.episode);
        self.steps.append_value(row.step);
        self.actions.values().append_slice(row.action);
        self.actions.append(true);
        self.computation_times
            .append_value(nanoseconds(row.timing.computation_time_s));
        self.host_interferences
            .append_value(nanoseconds(row.timing.host_time_s));
        self.cpu_times
            .append_option(row.timing.cpu_time_s.map(nanoseconds));
        let state_and_constraints = &mut self.state_and_constraints;
        row.world.record_state(state_and_constraints);
        state_and_constraints.put(row.world.constraint_values());
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
        columns.push(Arc::new(self.host_interferences.finish()));
        columns.push(Arc::new(self.cpu_times.finish()));
        columns.extend(self.state_and_constraints.take());
        columns
    }
}

/// Column of computation times, ns.
const COMPUTATION_TIME: &str = "computation_time_ns";
/// Column of host interference, ns: time that other programs on the evaluator's machine took. It exists since layout 4.
pub(crate) const HOST_INTERFERENCE: &str = "host_time_ns";

/// Adds the column for host interference to the schema of an earlier layout's table of control steps.
pub(crate) fn schema_with_host_interference(schema: &Schema) -> Schema {
    let mut fields = schema.fields().to_vec();
    let field = Arc::new(Field::new(HOST_INTERFERENCE, DataType::Int64, false));
    fields.insert(host_interference_index(schema), field);
    Schema::new_with_metadata(fields, schema.metadata().clone())
}

/// Adds the column for host interference to rows of an earlier layout: 0, since it was not recorded.
pub(crate) fn with_zero_host_interference(batch: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let mut columns = batch.columns().to_vec();
    let zeros = Int64Array::from_value(0, batch.num_rows());
    columns.insert(host_interference_index(&batch.schema()), Arc::new(zeros));
    RecordBatch::try_new(
        Arc::new(schema_with_host_interference(&batch.schema())),
        columns,
    )
}

/// Index of the column for host interference: after the computation time.
fn host_interference_index(schema: &Schema) -> usize {
    let times = schema.column_with_name(COMPUTATION_TIME);
    times.map_or(schema.fields().len(), |(index, _)| index + 1)
}

/// Columns of the constraint values, in their order in the table. A constraint is violated if its value is above 0.
pub(crate) fn constraint_columns(recording: &RecordingColumns) -> Vec<String> {
    let limits = recording.limits.iter();
    limits.map(|name| format!("constraint_{name}")).collect()
}
