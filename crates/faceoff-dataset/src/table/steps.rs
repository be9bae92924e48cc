use super::columns::{FloatColumns, joints};
use crate::times::nanoseconds;
use arrow_array::{
    ArrayRef, Int64Array, RecordBatch, StringArray,
    builder::{Float64Builder, Int64Builder, ListBuilder, UInt32Builder},
};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};
use faceoff_episode::StepRow;
use faceoff_types::Task;
use std::sync::Arc;

/// Numbers of an observation with an opponent on the table.
const OBSERVATION_MAX: usize = 23;

/// Columns of an observation, in the protocol's order, their names after `prefix`; absent ones are
/// null.
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

/// Fills the columns of an observation; an empty one is absent as a whole.
pub(super) fn put_observation(columns: &mut FloatColumns, observation: &[f64]) {
    columns.put(observation);
    columns.put_absent(OBSERVATION_MAX - observation.len());
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
    rest: FloatColumns,
}

impl StepRows {
    pub fn new(task: Task) -> Self {
        let observations = observation_columns("obs_", false);
        let rest = FloatColumns::default()
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
        fields.extend_from_slice(rest.fields());
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
            rest,
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
            self.rest.take();
        }
    }

    pub fn observe(&mut self, observation: &[f64]) {
        put_observation(&mut self.observations, observation);
        self.observations.end_row();
    }

    pub fn push(&mut self, row: &StepRow<'_>) {
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
        let rest = &mut self.rest;
        rest.put_state(row.state);
        let c = row.constraints;
        rest.put(&[c.joint_pos, c.joint_vel, c.ee, c.link]);
        rest.end_row();
    }

    /// The rows so far, which are removed.
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
        columns.extend(self.rest.take());
        columns
    }
}

const COMPUTATION_TIME: &str = "computation_time_ns";
/// What the host took of a step's time; a column since layout 4.
pub(crate) const HOST_TIME: &str = "host_time_ns";

/// The columns of a table of control steps of an earlier layout, with the one for the host's time.
pub(crate) fn with_host_time(schema: &Schema) -> Schema {
    let mut fields = schema.fields().to_vec();
    let field = Arc::new(Field::new(HOST_TIME, DataType::Int64, false));
    fields.insert(place(schema), field);
    Schema::new_with_metadata(fields, schema.metadata().clone())
}

/// Rows of an earlier layout in which the host took nothing, for nothing was told apart then.
pub(crate) fn without_host_time(batch: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let mut columns = batch.columns().to_vec();
    let none = Int64Array::from_value(0, batch.num_rows());
    columns.insert(place(&batch.schema()), Arc::new(none));
    RecordBatch::try_new(Arc::new(with_host_time(&batch.schema())), columns)
}

/// After the computation time.
fn place(schema: &Schema) -> usize {
    let times = schema.column_with_name(COMPUTATION_TIME);
    times.map_or(schema.fields().len(), |(index, _)| index + 1)
}

/// Constraint values per step, in the order of the columns.
pub(crate) const CONSTRAINTS: [&str; 4] = [
    "constraint_joint_pos",
    "constraint_joint_vel",
    "constraint_ee",
    "constraint_link",
];
