//! Reads `steps.parquet`, a dataset's table with one row per control step.

use super::{file_range::FileRange, footer::check_table};
use crate::{
    error::DatasetError,
    files::STEPS_FILE,
    table::{HOST_INTERFERENCE, step_schema, with_zero_host_interference},
};
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::{DataType, Schema};
use faceoff_types::Competition;
use parquet::{
    arrow::{
        ProjectionMask,
        arrow_reader::{
            ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
        },
    },
    file::reader::ChunkReader,
};
use std::{collections::VecDeque, sync::Arc};

/// Number of rows in a decoded batch.
pub(crate) const BATCH_ROWS: usize = 1024;

/// Checks that every expected column exists and has its type.
pub(crate) fn check_columns(
    file: &str,
    found: &Schema,
    expected: &Schema,
) -> Result<(), DatasetError> {
    for field in expected.fields() {
        let has_type = found.column_with_name(field.name()).is_some_and(|(_, f)| {
            // Other writers name a list's items differently; only their type matters.
            match (f.data_type(), field.data_type()) {
                (DataType::List(a), DataType::List(b)) => a.data_type() == b.data_type(),
                (a, b) => a == b,
            }
        });
        if !has_type {
            return Err(DatasetError::Unreadable(format!(
                "{file} has no column {} of type {}",
                field.name(),
                field.data_type()
            )));
        }
    }
    Ok(())
}

/// Is it a table of a layout before 4, without the column for host interference (the time that other programs on the
/// evaluator's machine took)?
fn lacks_host_interference(found: &Schema) -> bool {
    found.column_with_name(HOST_INTERFERENCE).is_none()
}

/// A reader of a table of control steps, with all columns or the named ones.
pub(super) fn reader<R: ChunkReader + 'static>(
    table: R,
    metadata: &ArrowReaderMetadata,
    columns: Option<&[String]>,
    competition: &Competition,
) -> Result<ParquetRecordBatchReaderBuilder<R>, DatasetError> {
    let found = metadata.schema();
    let lacks_host_interference = lacks_host_interference(found);
    let current_schema = step_schema(&competition.recording);
    let fields = current_schema.fields().iter();
    let fields =
        fields.filter(|field| !lacks_host_interference || field.name() != HOST_INTERFERENCE);
    let expected = Schema::new(fields.cloned().collect::<Vec<_>>());
    check_columns(STEPS_FILE, found, &expected)?;
    if found.fields().len() != expected.fields().len() {
        return Err(DatasetError::Unreadable(format!(
            "{STEPS_FILE} has {} columns, expected {}",
            found.fields().len(),
            expected.fields().len()
        )));
    }
    let mask = match columns {
        None => ProjectionMask::all(),
        Some(names) => {
            for name in names {
                if found.column_with_name(name).is_none() {
                    let existing: Vec<&str> = found
                        .fields()
                        .iter()
                        .map(|field| field.name().as_str())
                        .collect();
                    return Err(DatasetError::Absent(format!(
                        "there is no column {name:?}; there are {}",
                        existing.join(", ")
                    )));
                }
            }
            ProjectionMask::columns(metadata.parquet_schema(), names.iter().map(String::as_str))
        }
    };
    Ok(
        ParquetRecordBatchReaderBuilder::new_with_metadata(table, metadata.clone())
            .with_projection(mask)
            .with_batch_size(BATCH_ROWS.max(competition.longest_episode_steps() as usize)),
    )
}

/// An open `steps.parquet`.
#[derive(Debug)]
pub struct StepTable {
    table: FileRange,
    metadata: ArrowReaderMetadata,
    competition: Arc<Competition>,
}

impl StepTable {
    pub(crate) fn open(
        table: FileRange,
        competition: &Arc<Competition>,
    ) -> Result<Self, DatasetError> {
        let metadata = ArrowReaderMetadata::load(&table, Default::default())
            .and_then(|metadata| {
                check_table(&table, metadata.metadata())?;
                Ok(metadata)
            })
            .map_err(DatasetError::unreadable(STEPS_FILE))?;
        Ok(Self {
            table,
            metadata,
            competition: competition.clone(),
        })
    }

    /// Does the table record host interference? Tables since layout 4 do.
    pub(crate) fn has_host_interference(&self) -> bool {
        !lacks_host_interference(self.metadata.schema())
    }

    /// All rows in order, in batches, with all columns or the named ones. In a table of an earlier layout host
    /// interference is read as 0.
    ///
    /// # Errors
    /// [`DatasetError::Absent`] if a column is unknown, [`DatasetError::Unreadable`] if the table is
    /// damaged.
    pub fn read(self, columns: Option<&[String]>) -> Result<StepBatches, DatasetError> {
        let is_host_interference = |name: &String| name == HOST_INTERFERENCE;
        let adds_host_interference = !self.has_host_interference()
            && columns.is_none_or(|names| names.iter().any(is_host_interference));
        let columns = columns.map(|names| -> Vec<String> {
            let exists = |name: &&String| !(adds_host_interference && is_host_interference(name));
            names.iter().filter(exists).cloned().collect()
        });
        let columns = columns.as_deref();
        let reader = reader(self.table, &self.metadata, columns, &self.competition)?
            .build()
            .map_err(DatasetError::unreadable(STEPS_FILE))?;
        Ok(StepBatches {
            reader,
            adds_zero_host_interference: adds_host_interference,
            unread: VecDeque::new(),
        })
    }
}

/// Rows of `steps.parquet`, in order.
pub struct StepBatches {
    reader: ParquetRecordBatchReader,
    /// Is the missing column for host interference added, with zeros?
    adds_zero_host_interference: bool,
    /// Rows that [`StepBatches::take_rows`] has read but not returned.
    unread: VecDeque<RecordBatch>,
}

impl std::fmt::Debug for StepBatches {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StepBatches")
            .field("columns", &self.reader.schema().fields().len())
            .finish_non_exhaustive()
    }
}

impl StepBatches {
    /// The next rows, about a thousand; `None` after the last.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if the table is damaged.
    pub fn next_batch(&mut self) -> Result<Option<RecordBatch>, DatasetError> {
        if let Some(batch) = self.unread.pop_front() {
            return Ok(Some(batch));
        }
        let next = self.reader.next().transpose();
        next.and_then(|batch| match batch {
            Some(batch) if self.adds_zero_host_interference => {
                with_zero_host_interference(&batch).map(Some)
            }
            batch => Ok(batch),
        })
        .map_err(DatasetError::unreadable(STEPS_FILE))
    }

    /// The next `count` rows in batches; fewer at the table's end.
    ///
    /// # Errors
    /// As [`StepBatches::next_batch`].
    pub fn take_rows(&mut self, count: usize) -> Result<Vec<RecordBatch>, DatasetError> {
        let mut batches = Vec::new();
        let mut remaining = count;
        while remaining > 0 {
            let Some(batch) = self.next_batch()? else {
                break;
            };
            let taken = remaining.min(batch.num_rows());
            if taken < batch.num_rows() {
                self.unread
                    .push_front(batch.slice(taken, batch.num_rows() - taken));
            }
            if taken > 0 {
                batches.push(batch.slice(0, taken));
            }
            remaining -= taken;
        }
        Ok(batches)
    }
}
