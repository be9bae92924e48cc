use super::{
    StepRow,
    columns::{FloatColumns, joints},
    parquet_file::{self, TableWriter},
};
use crate::PlatformFault;
use arrow_array::{
    ArrayRef, Float64Array, RecordBatch, StringArray, UInt32Array,
    builder::{Float64Builder, ListBuilder, UInt32Builder},
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use arrow_schema::{DataType, Field, Schema};
use faceoff_types::Task;
use faceoff_wire::dataset::ConstraintViolation;
use std::{path::Path, sync::Arc};

/// Numbers of an observation with an opponent on the table.
const OBSERVATION_MAX: usize = 23;

/// The table of control steps: one row per answered step.
pub(super) struct StepsTable {
    writer: TableWriter,
    task: Task,
    episode: u32,
    episodes: UInt32Builder,
    steps: UInt32Builder,
    observations: FloatColumns,
    actions: ListBuilder<Float64Builder>,
    rest: FloatColumns,
}

impl StepsTable {
    pub fn create(path: &Path, task: Task) -> Result<Self, PlatformFault> {
        let observations = FloatColumns::default()
            .with(
                ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| format!("obs_puck_{c}")),
                false,
            )
            .with(joints("obs_q"), false)
            .with(joints("obs_dq"), false)
            .with(
                ["x", "y", "z"].map(|c| format!("obs_opponent_ee_{c}")),
                true,
            );
        let rest = FloatColumns::default()
            .with(["computation_time_s".to_owned()], false)
            .with(["cpu_time_s".to_owned()], true)
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
        fields.extend_from_slice(rest.fields());
        Ok(Self {
            writer: TableWriter::create(path, Schema::new(fields))?,
            task,
            episode: 0,
            episodes: UInt32Builder::new(),
            steps: UInt32Builder::new(),
            observations,
            actions: ListBuilder::new(Float64Builder::new()).with_field(item),
            rest,
        })
    }

    /// Begins an episode; rows of one that has not ended are dropped.
    pub fn begin(&mut self, episode: u32) {
        self.episode = episode;
        if !self.steps.values_slice().is_empty() {
            self.episodes.finish();
            self.steps.finish();
            self.observations.take();
            self.actions.finish();
            self.rest.take();
        }
    }

    pub fn observe(&mut self, observation: &[f64]) {
        self.observations.put(observation);
        self.observations
            .put_absent(OBSERVATION_MAX - observation.len());
        self.observations.end_row();
    }

    pub fn push(&mut self, row: &StepRow<'_>) {
        self.episodes.append_value(self.episode);
        self.steps.append_value(row.step);
        self.actions.values().append_slice(row.action);
        self.actions.append(true);
        let rest = &mut self.rest;
        rest.put(&[row.answered.computation_time_s]);
        rest.put_optional(row.answered.cpu_time_s.map(|time| [time]));
        rest.put_state(row.state);
        let c = row.constraints;
        rest.put(&[c.joint_pos, c.joint_vel, c.ee, c.link]);
        rest.end_row();
    }

    /// Hands the episode's rows to the file.
    pub fn flush(&mut self) -> Result<(), PlatformFault> {
        let episodes = self.episodes.finish();
        if episodes.is_empty() {
            return Ok(());
        }
        let tasks =
            StringArray::from_iter_values(std::iter::repeat_n(self.task.as_str(), episodes.len()));
        let mut columns: Vec<ArrayRef> = vec![
            Arc::new(tasks),
            Arc::new(episodes),
            Arc::new(self.steps.finish()),
        ];
        columns.extend(self.observations.take());
        columns.push(Arc::new(self.actions.finish()));
        columns.extend(self.rest.take());
        self.writer.write(columns)
    }

    pub fn finish(self) -> Result<(), PlatformFault> {
        self.writer.finish()
    }
}

/// Constraint values per step, in the order of the columns.
const CONSTRAINTS: [&str; 4] = [
    "constraint_joint_pos",
    "constraint_joint_vel",
    "constraint_ee",
    "constraint_link",
];

/// What scoring needs from a table of steps.
#[derive(Debug, Default)]
pub(crate) struct StepScan {
    /// Computation times of all steps, in seconds.
    pub computation_times_s: Vec<f64>,
    /// Violations per episode: joint position, joint velocity, end effector, link height.
    pub violations: [Vec<ConstraintViolation>; 4],
}

/// Reads the few columns that scoring needs, batch by batch, and adds them to `scan`.
pub(crate) fn scan_steps(path: &Path, scan: &mut StepScan) -> Result<(), PlatformFault> {
    let mut names = vec!["episode", "step", "computation_time_s"];
    names.extend(CONSTRAINTS);
    let damaged = |what: &str| PlatformFault::Recording(format!("{}: {what}", path.display()));
    for batch in parquet_file::read(path, &names)? {
        let batch: RecordBatch = batch.map_err(PlatformFault::recording(format!(
            "reading {}",
            path.display()
        )))?;
        let ints = |name: &str| -> Result<&UInt32Array, PlatformFault> {
            batch
                .column_by_name(name)
                .and_then(|column| column.as_primitive_opt::<UInt32Type>())
                .ok_or_else(|| damaged(&format!("no column {name}")))
        };
        let floats = |name: &str| -> Result<&Float64Array, PlatformFault> {
            batch
                .column_by_name(name)
                .and_then(|column| column.as_primitive_opt::<Float64Type>())
                .ok_or_else(|| damaged(&format!("no column {name}")))
        };
        scan.computation_times_s
            .extend_from_slice(floats("computation_time_s")?.values());
        let (episodes, steps) = (ints("episode")?.values(), ints("step")?.values());
        for (found, name) in scan.violations.iter_mut().zip(CONSTRAINTS) {
            let values = floats(name)?.values();
            for ((episode, step), value) in episodes.iter().zip(steps).zip(values) {
                if *value > 0.0 {
                    note(found, *episode, *step, *value);
                }
            }
        }
    }
    Ok(())
}

fn note(found: &mut Vec<ConstraintViolation>, episode: u32, step: u32, value: f64) {
    match found.last_mut() {
        Some(last) if last.episode == episode => {
            last.steps += 1;
            last.max = last.max.max(value);
        }
        _ => found.push(ConstraintViolation {
            episode,
            first_step: step,
            steps: 1,
            max: value,
        }),
    }
}
