use super::file_range::FileRange;
use crate::{error::DatasetError, files::STEPS_FILE, table::StepRows};
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::{DataType, Schema};
use faceoff_types::Task;
use parquet::{
    arrow::{
        ProjectionMask,
        arrow_reader::{
            ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
        },
    },
    file::reader::ChunkReader,
};
use std::collections::VecDeque;

/// Rows that are decoded at once.
const BATCH_ROWS: usize = 1024;

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
                (DataType::List(a), DataType::List(b)) => a.data_type() == b.data_type(),
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

/// A reader of a table of control steps, of all columns or of the named ones.
pub(super) fn reader<R: ChunkReader + 'static>(
    table: R,
    metadata: &ArrowReaderMetadata,
    columns: Option<&[String]>,
) -> Result<ParquetRecordBatchReaderBuilder<R>, DatasetError> {
    let (found, rows) = (metadata.schema(), StepRows::new(Task::Hit));
    has_columns(STEPS_FILE, found, rows.schema())?;
    if found.fields().len() != rows.schema().fields().len() {
        return Err(DatasetError::Unreadable(format!(
            "{STEPS_FILE} has {} columns, expected {}",
            found.fields().len(),
            rows.schema().fields().len()
        )));
    }
    let mask = match columns {
        None => ProjectionMask::all(),
        Some(names) => {
            for name in names {
                if found.column_with_name(name).is_none() {
                    let known: Vec<&str> = found
                        .fields()
                        .iter()
                        .map(|field| field.name().as_str())
                        .collect();
                    return Err(DatasetError::Absent(format!(
                        "there is no column {name:?}; there are {}",
                        known.join(", ")
                    )));
                }
            }
            ProjectionMask::columns(metadata.parquet_schema(), names.iter().map(String::as_str))
        }
    };
    Ok(
        ParquetRecordBatchReaderBuilder::new_with_metadata(table, metadata.clone())
            .with_projection(mask)
            .with_batch_size(BATCH_ROWS),
    )
}

/// `steps.parquet`, opened.
#[derive(Debug)]
pub struct StepTable {
    table: FileRange,
    metadata: ArrowReaderMetadata,
}

impl StepTable {
    pub(crate) fn open(table: FileRange) -> Result<Self, DatasetError> {
        let metadata = ArrowReaderMetadata::load(&table, Default::default())
            .map_err(DatasetError::unreadable(STEPS_FILE))?;
        Ok(Self { table, metadata })
    }

    /// All rows from the first on, batch by batch, of all columns or of the named ones.
    ///
    /// # Errors
    /// [`DatasetError::Absent`] if a column is unknown, [`DatasetError::Unreadable`] if the table is
    /// damaged.
    pub fn read(self, columns: Option<&[String]>) -> Result<StepBatches, DatasetError> {
        let reader = reader(self.table, &self.metadata, columns)?
            .build()
            .map_err(DatasetError::unreadable(STEPS_FILE))?;
        Ok(StepBatches {
            reader,
            read: VecDeque::new(),
        })
    }
}

/// Rows of `steps.parquet`, from the first on.
pub struct StepBatches {
    reader: ParquetRecordBatchReader,
    read: VecDeque<RecordBatch>,
}

impl std::fmt::Debug for StepBatches {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StepBatches")
            .field("columns", &self.reader.schema().fields().len())
            .finish_non_exhaustive()
    }
}

impl StepBatches {
    /// The next rows, a thousand or so; none after the last.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if the table is damaged.
    pub fn next_batch(&mut self) -> Result<Option<RecordBatch>, DatasetError> {
        if let Some(batch) = self.read.pop_front() {
            return Ok(Some(batch));
        }
        self.reader
            .next()
            .transpose()
            .map_err(DatasetError::unreadable(STEPS_FILE))
    }

    /// The next `count` rows, in pieces; fewer at the table's end.
    ///
    /// # Errors
    /// As [`StepBatches::next_batch`].
    pub fn take_rows(&mut self, count: usize) -> Result<Vec<RecordBatch>, DatasetError> {
        let mut pieces = Vec::new();
        let mut missing = count;
        while missing > 0 {
            let Some(batch) = self.next_batch()? else {
                break;
            };
            let taken = missing.min(batch.num_rows());
            if taken < batch.num_rows() {
                self.read
                    .push_front(batch.slice(taken, batch.num_rows() - taken));
            }
            if taken > 0 {
                pieces.push(batch.slice(0, taken));
            }
            missing -= taken;
        }
        Ok(pieces)
    }
}
