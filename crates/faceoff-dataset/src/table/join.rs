//! Joins the tables of an evaluation's shards (recordings of a part of its episodes) to one table.

use super::{
    column_orders::TypeDefinedOrderWriter,
    steps::{HOST_INTERFERENCE, schema_with_host_interference, with_zero_host_interference},
    writer::{TableWriter, schema_metadata},
};
use crate::error::RecordingError;
use crate::files::STEPS_FILE;
use fs_err::File;
use parquet::{
    arrow::{ARROW_SCHEMA_META_KEY, arrow_reader::ParquetRecordBatchReaderBuilder},
    column::writer::ColumnCloseResult,
    file::{
        metadata::{PageIndexPolicy, ParquetMetaData, ParquetMetaDataReader},
        properties::WriterProperties,
        writer::SerializedFileWriter,
    },
};
use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
};

/// A table of a shard.
#[derive(Debug, Clone)]
pub(crate) enum ShardTable {
    /// A table in the current layout: its bytes are copied.
    Current(PathBuf),
    /// A table in an earlier layout: its rows are rewritten.
    Earlier(PathBuf),
}

impl ShardTable {
    /// The path of the table.
    pub fn path(&self) -> &Path {
        match self {
            Self::Current(path) | Self::Earlier(path) => path,
        }
    }
}

/// Writes the row groups of several tables with one schema to one file. Tables of earlier layouts are first rewritten
/// to an unnamed file in the folder `temporary_dir`.
pub(crate) fn join<W: Write + Send>(
    tables: &[ShardTable],
    temporary_dir: &Path,
    out: W,
) -> Result<(), RecordingError> {
    let mut writer: Option<SerializedFileWriter<TypeDefinedOrderWriter<W>>> = None;
    let mut out = Some(out);
    for table in tables {
        let path = table.path();
        let file = match table {
            ShardTable::Current(path) => File::open(path)?.into_file(),
            ShardTable::Earlier(path) => rewrite(path, temporary_dir)?,
        };
        let join_error = || RecordingError::unusable(format!("joining {}", path.display()));
        let metadata = ParquetMetaDataReader::new()
            .with_column_index_policy(PageIndexPolicy::Skip)
            .with_offset_index_policy(PageIndexPolicy::Optional)
            .parse_and_finish(&file)
            .map_err(join_error())?;
        if let Some(out) = out.take() {
            writer =
                Some(begin(&metadata, TypeDefinedOrderWriter::new(out)).map_err(join_error())?);
        }
        let Some(writer) = &mut writer else {
            break;
        };
        if metadata.file_metadata().schema() != writer.schema_descr().root_schema() {
            return Err(RecordingError::Unusable(format!(
                "{} has other columns than the shards before it",
                path.display()
            )));
        }
        append(&metadata, &file, writer).map_err(join_error())?;
    }
    match writer {
        None => Err(RecordingError::Unusable("nothing to join".to_owned())),
        Some(writer) => {
            let columns = writer.schema_descr().num_columns();
            let mut out = writer
                .into_inner()
                .map_err(RecordingError::unusable("joining the recordings"))?;
            out.finish(columns)?;
            Ok(())
        }
    }
}

/// Begins a table with the columns of the first shard's table.
fn begin<W: Write + Send>(
    first: &ParquetMetaData,
    out: W,
) -> parquet::errors::Result<SerializedFileWriter<W>> {
    let metadata = first.file_metadata();
    let arrow_schema = metadata
        .key_value_metadata()
        .into_iter()
        .flatten()
        .filter(|entry| entry.key == ARROW_SCHEMA_META_KEY)
        .cloned();
    let properties = WriterProperties::builder()
        .set_key_value_metadata(Some(
            [schema_metadata()]
                .into_iter()
                .chain(arrow_schema)
                .collect(),
        ))
        .build();
    let schema = metadata.schema_descr().root_schema_ptr();
    SerializedFileWriter::new(out, schema, Arc::new(properties))
}

/// Copies all row groups of a table.
fn append<W: Write + Send>(
    metadata: &ParquetMetaData,
    file: &fs::File,
    writer: &mut SerializedFileWriter<W>,
) -> parquet::errors::Result<()> {
    for (index, group) in metadata.row_groups().iter().enumerate() {
        let pages = metadata.page_index_for_row_group(index);
        let mut out = writer.next_row_group()?;
        for (column_index, column) in group.columns().iter().enumerate() {
            let close = ColumnCloseResult {
                bytes_written: column.compressed_size().unsigned_abs(),
                rows_written: group.num_rows().unsigned_abs(),
                metadata: column.clone(),
                bloom_filter: None,
                column_index: None,
                offset_index: pages.offset_index(column_index).cloned(),
            };
            out.append_column(file, close)?;
        }
        out.close()?;
    }
    Ok(())
}

/// Rewrites a table in the current layout.
fn rewrite(path: &Path, temporary_dir: &Path) -> Result<fs::File, RecordingError> {
    let context = format!("reading {}", path.display());
    let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path)?.into_file())
        .map_err(RecordingError::unusable(&context))?;
    let file = tempfile::tempfile_in(temporary_dir)?;
    let copy = File::from_parts(file.try_clone()?, path);
    // Apart from this column, the layouts differ only in how the Parquet writer encodes them.
    let lacks_host_interference = path.ends_with(STEPS_FILE)
        && builder
            .schema()
            .column_with_name(HOST_INTERFERENCE)
            .is_none();
    let schema = if lacks_host_interference {
        Arc::new(schema_with_host_interference(builder.schema()))
    } else {
        builder.schema().clone()
    };
    let mut writer = TableWriter::new(copy, &schema)?;
    for batch in builder
        .build()
        .map_err(RecordingError::unusable(&context))?
    {
        let mut batch = batch.map_err(RecordingError::unusable(&context))?;
        if lacks_host_interference {
            batch =
                with_zero_host_interference(&batch).map_err(RecordingError::unusable(&context))?;
        }
        writer.write(batch.columns().to_vec())?;
    }
    writer.finish()?;
    Ok(file)
}
