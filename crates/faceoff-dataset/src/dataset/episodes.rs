//! Reads `episodes.parquet`, a dataset's table with one row per episode.

use super::{file_range::FileRange, footer::check_table, steps::check_columns};
use crate::{error::DatasetError, files::EPISODES_FILE, table::EpisodeRows};
use arrow_array::{
    Array, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use faceoff_types::{Competition, ComputationTime, EpisodeOutcome, InvalidShortName};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde::Serialize;
use std::sync::Arc;

/// A table is read if it has at most twice the expected number of rows, plus this number.
const SURPLUS_ROWS: u64 = 1000;

/// One row of `episodes.parquet`, without the hashes. Its JSON has neither observation nor state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeRecord {
    /// The outcome, as scoring uses it.
    #[serde(flatten)]
    pub outcome: EpisodeOutcome,
    /// Seed of the episode, 64 hexadecimal digits.
    pub seed: String,
    /// The agent's interpolation: `1` … `5`, `-1` or `null`; absent if the agent failed to start.
    pub interpolation: Option<String>,
    /// Penalty points, including those for computation time.
    pub penalty_points: f64,
    /// The observation after the last answered step; empty if no step was answered.
    #[serde(skip)]
    pub last_observation: Vec<f64>,
    /// The true state before the first step, in the order of the competition's columns
    /// ([`RecordingColumns::state`](faceoff_types::RecordingColumns::state)).
    #[serde(skip)]
    pub initial_state: Vec<Option<f64>>,
}

/// The table as Arrow batches, after a check of its columns and that it has not many more rows than expected, since all of
/// it is held in memory.
pub(crate) fn batches(
    table: FileRange,
    expected_rows: u64,
    competition: &Arc<Competition>,
) -> Result<Vec<RecordBatch>, DatasetError> {
    let builder = ParquetRecordBatchReaderBuilder::try_new(table.clone())
        .and_then(|builder| {
            check_table(&table, builder.metadata())?;
            Ok(builder)
        })
        .map_err(DatasetError::unreadable(EPISODES_FILE))?;
    let groups = builder.metadata().row_groups().iter();
    let rows = groups
        .map(|group| group.num_rows().unsigned_abs())
        .fold(0, u64::saturating_add);
    // If only a few rows are missing or surplus, the caller reports which.
    if rows > expected_rows.saturating_mul(2).saturating_add(SURPLUS_ROWS) {
        return Err(DatasetError::Unreadable(format!(
            "{EPISODES_FILE} has {rows} rows, expected {expected_rows}"
        )));
    }
    check_columns(
        EPISODES_FILE,
        builder.schema(),
        EpisodeRows::new(competition).schema(),
    )?;
    let reader = builder
        .build()
        .map_err(DatasetError::unreadable(EPISODES_FILE))?;
    reader
        .collect::<Result<Vec<_>, _>>()
        .map_err(DatasetError::unreadable(EPISODES_FILE))
}

pub(super) fn records(
    batches: &[RecordBatch],
    competition: &Competition,
) -> Result<Vec<EpisodeRecord>, DatasetError> {
    let mut records = Vec::new();
    for batch in batches {
        let columns = Columns(batch);
        for row in 0..batch.num_rows() {
            let record = columns.record(row, competition);
            records.push(record.map_err(DatasetError::unreadable(format!(
                "{EPISODES_FILE}, row {}",
                records.len()
            )))?);
        }
    }
    Ok(records)
}

/// Access to the columns of a batch that was checked to have them.
pub(crate) struct Columns<'a>(pub &'a RecordBatch);

impl<'a> Columns<'a> {
    fn column(&self, name: &str) -> &'a dyn Array {
        self.0
            .column_by_name(name)
            .expect("the columns were checked when the table was read")
    }

    /// The text in a cell; `None` for null.
    pub fn text(&self, name: &str, row: usize) -> Option<&'a str> {
        let column: &StringArray = self.column(name).as_string();
        column.is_valid(row).then(|| column.value(row))
    }

    /// The number in a cell; `None` for null.
    pub fn int(&self, name: &str, row: usize) -> Option<u32> {
        let column: &UInt32Array = self.column(name).as_primitive::<UInt32Type>();
        column.is_valid(row).then(|| column.value(row))
    }

    fn float(&self, name: &str, row: usize) -> f64 {
        let column: &Float64Array = self.column(name).as_primitive::<Float64Type>();
        column.value(row)
    }

    fn optional_float(&self, name: &str, row: usize) -> Option<f64> {
        let is_valid = self.column(name).is_valid(row);
        is_valid.then(|| self.float(name, row))
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

    pub fn record(&self, row: usize, competition: &Competition) -> Result<EpisodeRecord, String> {
        let absent = |name: &str| format!("{name} is absent");
        let text = |name| self.text(name, row).ok_or_else(|| absent(name));
        let int = |name| self.int(name, row).ok_or_else(|| absent(name));
        let (task, end) = (text("task")?, text("end")?);
        let fault = self.text("fault", row).map(serde_json::from_str);
        let outcome = EpisodeOutcome {
            task: task
                .parse()
                .map_err(|error: InvalidShortName| error.to_string())?,
            episode: int("episode")?,
            steps: int("steps")?,
            end: serde_json::from_value(end.into())
                .map_err(|_| format!("the end {end:?} is unknown"))?,
            success: self.flag("success", row),
            violations: competition
                .world_violations()
                .map(|name| (name, self.flag(&format!("violated_{name}"), row)))
                .collect(),
            computation_time: ComputationTime {
                mean_s: self.float("computation_time_mean_s", row),
                max_s: self.float("computation_time_max_s", row),
            },
            fault: fault
                .transpose()
                .map_err(|error| format!("fault: {error}"))?,
        };
        Ok(EpisodeRecord {
            outcome,
            seed: text("seed")?.to_owned(),
            interpolation: self.text("interpolation", row).map(str::to_owned),
            penalty_points: self.float("penalty_points", row),
            last_observation: self.last_observation(row),
            initial_state: competition
                .recording
                .state
                .iter()
                .map(|column| self.optional_float(&format!("initial_{}", column.name), row))
                .collect(),
        })
    }
}
