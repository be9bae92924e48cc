//! Reads the rows of one episode from `steps.parquet` without the others.
//!
//! A Parquet table consists of row groups, and each column of a row group of pages. The bounds of the columns `task` and
//! `episode` select the row groups, the values of these columns the rows, and the page index the pages. Tables without
//! bounds or index need more reading.

use super::{footer, pages::IndexedPages, steps::reader};
use crate::{error::DatasetError, files::STEPS_FILE};
use arrow_array::{
    BooleanArray, RecordBatch, RecordBatchReader, StringArray, UInt32Array, cast::AsArray,
};
use faceoff_types::{Competition, Task};
use parquet::{
    arrow::arrow_reader::{ArrowReaderMetadata, RowSelection},
    errors::{ParquetError, Result},
    file::{
        metadata::{ColumnChunkMask, PageIndexPolicy, ParquetMetaDataReader, RowGroupMetaData},
        reader::ChunkReader,
        statistics::Statistics,
    },
};
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// The rows of one episode, with all columns or the named ones.
pub(super) fn episode<R: ChunkReader + Clone + 'static>(
    table: R,
    task: Task,
    episode: u32,
    columns: Option<&[String]>,
    competition: &Competition,
) -> std::result::Result<RecordBatch, DatasetError> {
    let unreadable = || DatasetError::unreadable::<ParquetError>(STEPS_FILE);
    let (metadata, groups) = row_groups(&table, task, episode).map_err(unreadable())?;
    let table = IndexedPages::new(table, metadata.metadata(), &groups).map_err(unreadable())?;

    let key_columns = ["task".to_owned(), "episode".to_owned()];
    let keys = reader(table.clone(), &metadata, Some(&key_columns), competition)?
        .with_row_groups(groups.clone())
        .build()
        .map_err(unreadable())?;
    let filters = keys
        .map(|batch| Ok(episode_filter(&batch?, task, episode)))
        .collect::<Result<Vec<BooleanArray>>>()
        .map_err(unreadable())?;
    let count: usize = filters.iter().map(BooleanArray::true_count).sum();
    let longest = competition.max_steps(task);
    if count > longest as usize {
        return Err(DatasetError::Unreadable(format!(
            "{STEPS_FILE} has {count} steps of {task}, episode {episode}; at most {longest} \
             are possible"
        )));
    }

    let mut batches = reader(table, &metadata, columns, competition)?
        .with_row_groups(groups)
        .with_row_selection(RowSelection::from_filters(&filters))
        .build()
        .map_err(unreadable())?;
    // One batch is enough: it can hold more rows than an episode has.
    match batches.next() {
        Some(batch) => batch.map_err(DatasetError::unreadable(STEPS_FILE)),
        None => Ok(RecordBatch::new_empty(batches.schema())),
    }
}

/// The row groups that may contain the episode, with their page index.
fn row_groups<R: ChunkReader>(
    table: &R,
    task: Task,
    episode: u32,
) -> Result<(ArrowReaderMetadata, Vec<usize>)> {
    let metadata = ParquetMetaDataReader::new().parse_and_finish(table)?;
    footer::check(&metadata, table.len())?;
    let groups: Vec<usize> = metadata
        .row_groups()
        .iter()
        .enumerate()
        .filter(|(_, group)| may_contain(group, task, episode))
        .map(|(index, _)| index)
        .collect();
    let mut indexed = ParquetMetaDataReader::new_with_metadata(metadata)
        .with_column_index_policy(PageIndexPolicy::Skip)
        .with_offset_index_policy(PageIndexPolicy::Optional)
        .with_offset_index_mask(ColumnChunkMask::row_groups(groups.iter().copied()));
    indexed.read_page_indexes(table)?;
    let metadata = ArrowReaderMetadata::try_new(Arc::new(indexed.finish()?), Default::default())?;
    Ok((metadata, groups))
}

/// Do the bounds of the columns allow that a row group contains the episode? True without bounds.
fn may_contain(group: &RowGroupMetaData, task: Task, episode: u32) -> bool {
    let bounds = |name: &str| {
        let mut columns = group.columns().iter();
        columns
            .find(|column| column.column_path().string() == name)
            .and_then(|column| column.statistics())
    };
    let task = task.as_str().as_bytes();
    let task_matches = match bounds("task") {
        Some(Statistics::ByteArray(bounds)) => {
            bounds.min_opt().is_none_or(|min| min.data() <= task)
                && bounds.max_opt().is_none_or(|max| max.data() >= task)
        }
        _ => true,
    };
    let episode_matches = match bounds("episode") {
        // Parquet stores unsigned 32-bit numbers as signed ones.
        Some(Statistics::Int32(bounds)) => {
            bounds
                .min_opt()
                .is_none_or(|min| min.cast_unsigned() <= episode)
                && bounds
                    .max_opt()
                    .is_none_or(|max| max.cast_unsigned() >= episode)
        }
        _ => true,
    };
    task_matches && episode_matches
}

/// Whether each row belongs to the episode.
fn episode_filter(batch: &RecordBatch, task: Task, episode: u32) -> BooleanArray {
    let tasks: &StringArray = batch["task"].as_string();
    let episodes: &UInt32Array = batch["episode"].as_primitive();
    (0..batch.num_rows())
        .map(|row| Some(tasks.value(row) == task.as_str() && episodes.value(row) == episode))
        .collect()
}
