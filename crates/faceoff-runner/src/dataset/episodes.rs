use super::{Dataset, DatasetError};
use crate::recording::{EPISODES_FILE, EpisodeRows};
use arrow_array::{
    Array, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use arrow_schema::Schema;
use faceoff_types::{AgentFault, ComputationTime, Task, Violations};
use serde::Serialize;

/// One row of `episodes.parquet`, without the states.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeRecord {
    /// The task.
    pub task: Task,
    /// Its index within the evaluation, from 0.
    pub episode: u32,
    /// The episode's seed, 64 hexadecimal digits.
    pub seed: String,
    /// The agent's interpolation: `1` … `5`, `-1` or `null`; absent if it did not get as far as to
    /// say.
    pub interpolation: Option<String>,
    /// Control steps played.
    pub steps: u32,
    /// Why it ended.
    pub end: String,
    /// Success.
    pub success: bool,
    /// Constraints broken at least once.
    pub violations: Violations,
    /// Penalty points, computation time included.
    pub penalty_points: f64,
    /// The agent's computation times, in seconds.
    pub computation_time: ComputationTime,
    /// The agent's fault, if the episode ended by one.
    pub fault: Option<AgentFault>,
    /// The observation after the last answered step: 23 numbers for `hit`, 20 otherwise, none if no
    /// step was answered.
    #[serde(skip)]
    pub last_observation: Vec<f64>,
}

/// The table as it is, in batches, its columns checked.
pub(crate) fn batches(dataset: &Dataset) -> Result<Vec<RecordBatch>, DatasetError> {
    let reader = dataset
        .table(EPISODES_FILE)?
        .with_batch_size(1024)
        .build()
        .map_err(DatasetError::unreadable(EPISODES_FILE))?;
    let batches = reader
        .collect::<Result<Vec<_>, _>>()
        .map_err(DatasetError::unreadable(EPISODES_FILE))?;
    let rows = EpisodeRows::new();
    for batch in &batches {
        has_columns(EPISODES_FILE, &batch.schema(), rows.schema())?;
    }
    Ok(batches)
}

/// Every expected column is there, with its type.
pub(super) fn has_columns(
    file: &str,
    found: &Schema,
    expected: &Schema,
) -> Result<(), DatasetError> {
    for field in expected.fields() {
        let ok = found.column_with_name(field.name()).is_some_and(|(_, f)| {
            // Other writers name a list's items otherwise; only what they are matters.
            match (f.data_type(), field.data_type()) {
                (arrow_schema::DataType::List(a), arrow_schema::DataType::List(b)) => {
                    a.data_type() == b.data_type()
                }
                (a, b) => a == b,
            }
        });
        if !ok {
            return Err(DatasetError::Unreadable(format!(
                "{file} has no column {} of type {}",
                field.name(),
                field.data_type()
            )));
        }
    }
    Ok(())
}

pub(super) fn read(dataset: &Dataset) -> Result<Vec<EpisodeRecord>, DatasetError> {
    let mut records = Vec::new();
    for batch in batches(dataset)? {
        let columns = Columns(&batch);
        for row in 0..batch.num_rows() {
            records.push(columns.record(row)?);
        }
    }
    Ok(records)
}

/// A batch whose columns are known to be there.
pub(crate) struct Columns<'a>(pub &'a RecordBatch);

impl<'a> Columns<'a> {
    fn column(&self, name: &str) -> &'a dyn Array {
        self.0
            .column_by_name(name)
            .expect("the columns were checked when the table was read")
    }

    pub fn text(&self, name: &str, row: usize) -> Option<&'a str> {
        let column: &StringArray = self.column(name).as_string();
        column.is_valid(row).then(|| column.value(row))
    }

    pub fn int(&self, name: &str, row: usize) -> Option<u32> {
        let column: &UInt32Array = self.column(name).as_primitive::<UInt32Type>();
        column.is_valid(row).then(|| column.value(row))
    }

    fn float(&self, name: &str, row: usize) -> f64 {
        let column: &Float64Array = self.column(name).as_primitive::<Float64Type>();
        column.value(row)
    }

    fn flag(&self, name: &str, row: usize) -> bool {
        let column: &BooleanArray = self.column(name).as_boolean();
        column.is_valid(row) && column.value(row)
    }

    fn last_observation(&self, row: usize) -> Vec<f64> {
        let schema = self.0.schema();
        let columns = schema.fields().iter().map(|field| field.name());
        columns
            .filter(|name| name.starts_with("last_obs_") && self.column(name).is_valid(row))
            .map(|name| self.float(name, row))
            .collect()
    }

    fn record(&self, row: usize) -> Result<EpisodeRecord, DatasetError> {
        let wrong =
            |what: &str| DatasetError::Unreadable(format!("{EPISODES_FILE}, row {row}: {what}"));
        let text = |name: &str| {
            self.text(name, row)
                .ok_or_else(|| wrong(&format!("{name} is absent")))
        };
        let int = |name: &str| {
            self.int(name, row)
                .ok_or_else(|| wrong(&format!("{name} is absent")))
        };
        let fault = self
            .text("fault", row)
            .map(serde_json::from_str)
            .transpose()
            .map_err(|error| wrong(&format!("fault: {error}")))?;
        Ok(EpisodeRecord {
            task: text("task")?
                .parse()
                .map_err(|error: faceoff_types::ParseTaskError| wrong(&error.to_string()))?,
            episode: int("episode")?,
            seed: text("seed")?.to_owned(),
            interpolation: self.text("interpolation", row).map(str::to_owned),
            steps: int("steps")?,
            end: text("end")?.to_owned(),
            success: self.flag("success", row),
            violations: Violations {
                ee: self.flag("violated_ee", row),
                link: self.flag("violated_link", row),
                joint_pos: self.flag("violated_joint_pos", row),
                joint_vel: self.flag("violated_joint_vel", row),
            },
            penalty_points: self.float("penalty_points", row),
            computation_time: ComputationTime {
                mean_s: self.float("computation_time_mean_s", row),
                max_s: self.float("computation_time_max_s", row),
            },
            fault,
            last_observation: self.last_observation(row),
        })
    }
}
