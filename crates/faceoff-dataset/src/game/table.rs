//! Reads a table of a game's recording row by row.

use crate::{
    dataset::{BATCH_ROWS, FileRange, check_columns, check_table},
    error::DatasetError,
};
use arrow_array::RecordBatch;
use arrow_schema::Schema;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

/// A table of a game, read in order.
pub(super) struct GameTable {
    name: &'static str,
    reader: ParquetRecordBatchReader,
    /// Rows that were read but not used yet; not empty after [`Self::fill`] has found a row.
    buffered: Option<RecordBatch>,
}

impl GameTable {
    pub fn open(
        table: FileRange,
        name: &'static str,
        expected: &Schema,
    ) -> Result<Self, DatasetError> {
        let unreadable = || DatasetError::unreadable(name);
        let builder =
            ParquetRecordBatchReaderBuilder::try_new(table.clone()).map_err(unreadable())?;
        check_table(&table, builder.metadata()).map_err(unreadable())?;
        let found = builder.schema();
        check_columns(name, found, expected)?;
        if found.fields().len() != expected.fields().len() {
            return Err(DatasetError::Unreadable(format!(
                "{name} has {} columns, expected {}",
                found.fields().len(),
                expected.fields().len()
            )));
        }
        let reader = builder
            .with_batch_size(BATCH_ROWS)
            .build()
            .map_err(unreadable())?;
        Ok(Self {
            name,
            reader,
            buffered: None,
        })
    }

    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Reads rows if none are buffered. Returns the number of rows that can be taken at once; 0 after the last row.
    pub fn fill(&mut self) -> Result<usize, DatasetError> {
        while self
            .buffered
            .as_ref()
            .is_none_or(|batch| batch.num_rows() == 0)
        {
            let next = self.reader.next().transpose();
            match next.map_err(DatasetError::unreadable(self.name))? {
                Some(batch) => self.buffered = Some(batch),
                None => return Ok(0),
            }
        }
        Ok(self.buffered.as_ref().map_or(0, RecordBatch::num_rows))
    }

    /// Takes `count` of the buffered rows.
    pub fn take(&mut self, count: usize) -> Option<RecordBatch> {
        let buffered = self.buffered.take()?;
        let taken = buffered.slice(0, count);
        self.buffered = Some(buffered.slice(count, buffered.num_rows() - count));
        Some(taken)
    }

    /// Takes the next row; `None` after the last.
    pub fn next_row(&mut self) -> Result<Option<RecordBatch>, DatasetError> {
        Ok(if self.fill()? > 0 { self.take(1) } else { None })
    }
}
