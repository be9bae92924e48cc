use super::{Dataset, DatasetError, episodes::has_columns, part::Part};
use crate::recording::{STEPS_FILE, StepRows};
use arrow_array::{RecordBatch, RecordBatchReader, cast::AsArray, types::UInt32Type};
use faceoff_types::Task;
use parquet::arrow::{
    ProjectionMask,
    arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder},
};
use std::collections::VecDeque;

/// Rows that are decoded at once.
const BATCH_ROWS: usize = 1024;

/// `steps.parquet`, opened.
pub struct StepTable {
    builder: ParquetRecordBatchReaderBuilder<Part>,
}

impl std::fmt::Debug for StepTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StepTable").finish_non_exhaustive()
    }
}

impl StepTable {
    pub(super) fn open(dataset: &Dataset) -> Result<Self, DatasetError> {
        let builder = dataset.table(STEPS_FILE)?;
        let rows = StepRows::new(Task::Hit);
        has_columns(STEPS_FILE, builder.schema(), rows.schema())?;
        if builder.schema().fields().len() != rows.schema().fields().len() {
            return Err(DatasetError::Unreadable(format!(
                "{STEPS_FILE} has {} columns, expected {}",
                builder.schema().fields().len(),
                rows.schema().fields().len()
            )));
        }
        Ok(Self { builder })
    }

    /// The columns' names, in order.
    #[must_use]
    pub fn columns(&self) -> Vec<String> {
        let fields = self.builder.schema().fields();
        fields.iter().map(|field| field.name().clone()).collect()
    }

    /// All rows from the first on, batch by batch, of all columns or of the named ones.
    ///
    /// # Errors
    /// [`DatasetError::Unreadable`] if a column is unknown or the table is damaged.
    pub fn read(self, columns: Option<&[String]>) -> Result<StepBatches, DatasetError> {
        let mask = match columns {
            None => ProjectionMask::all(),
            Some(names) => {
                let known = self.columns();
                for name in names {
                    if !known.contains(name) {
                        return Err(DatasetError::Unreadable(format!(
                            "there is no column {name:?}; there are {}",
                            known.join(", ")
                        )));
                    }
                }
                ProjectionMask::columns(
                    self.builder.parquet_schema(),
                    names.iter().map(String::as_str),
                )
            }
        };
        let reader = self
            .builder
            .with_projection(mask)
            .with_batch_size(BATCH_ROWS)
            .build()
            .map_err(DatasetError::unreadable(STEPS_FILE))?;
        Ok(StepBatches {
            reader,
            read: VecDeque::new(),
        })
    }

    /// The rows of one episode.
    ///
    /// # Errors
    /// As [`StepTable::read`].
    pub fn episode(
        self,
        task: Task,
        episode: u32,
        columns: Option<&[String]>,
    ) -> Result<Vec<RecordBatch>, DatasetError> {
        let mut wanted = columns.map(<[String]>::to_vec);
        if let Some(names) = &mut wanted {
            for key in ["task", "episode"] {
                if !names.iter().any(|name| name == key) {
                    names.push(key.to_owned());
                }
            }
        }
        let mut found = Vec::new();
        let mut batches = self.read(wanted.as_deref())?;
        while let Some(batch) = batches.next_batch()? {
            let tasks = batch["task"].as_string::<i32>();
            let episodes = batch["episode"].as_primitive::<UInt32Type>();
            let mine =
                |row: usize| tasks.value(row) == task.as_str() && episodes.value(row) == episode;
            // Rows are in order: an episode's rows follow each other.
            let Some(first) = (0..batch.num_rows()).find(|row| mine(*row)) else {
                if found.is_empty() {
                    continue;
                }
                break;
            };
            let rows = (first..batch.num_rows()).take_while(|row| mine(*row));
            found.push(batch.slice(first, rows.count()));
        }
        Ok(found)
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
