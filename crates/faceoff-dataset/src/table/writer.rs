//! Writes a Parquet table, with row groups and pages of a size that lets readers find one episode quickly.

use super::column_orders::TypeDefinedOrderWriter;
use crate::error::RecordingError;
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, Schema, SchemaRef};
use faceoff_wire::dataset::DATASET_SCHEMA;
use fs_err::File;
use parquet::{
    arrow::ArrowWriter,
    basic::{Compression, Encoding, ZstdLevel},
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
    },
    schema::types::ColumnPath,
};
use std::path::Path;

/// Rows after which a row group is closed. This bounds the memory of a writer.
const ROW_GROUP_ROWS: usize = 32_768;
/// Rows after which a page is closed. Reading one episode decompresses one or two pages per column; smaller pages
/// would make datasets larger for little gain.
const PAGE_ROWS: usize = 1024;
/// Compression level. Higher levels search longer for repetitions, which noisy measurements do not have: they would cost
/// most of a recording's CPU time, for files that are one percent smaller.
const ZSTD_LEVEL: i32 = 1;

/// Writer of one Parquet file.
pub(crate) struct TableWriter {
    /// What the writer does, for error messages.
    context: String,
    schema: SchemaRef,
    writer: ArrowWriter<TypeDefinedOrderWriter<File>>,
}

impl TableWriter {
    pub fn create(path: &Path, schema: &SchemaRef) -> Result<Self, RecordingError> {
        Self::create_with_layout(DATASET_SCHEMA, path, schema)
    }

    /// Creates a table with the name of a layout in its metadata.
    pub fn create_with_layout(
        layout: &str,
        path: &Path,
        schema: &SchemaRef,
    ) -> Result<Self, RecordingError> {
        Self::new_with_layout(layout, File::create(path)?, schema)
    }

    pub fn new(file: File, schema: &SchemaRef) -> Result<Self, RecordingError> {
        Self::new_with_layout(DATASET_SCHEMA, file, schema)
    }

    fn new_with_layout(
        layout: &str,
        file: File,
        schema: &SchemaRef,
    ) -> Result<Self, RecordingError> {
        let context = format!("writing {}", file.path().display());
        let properties = Some(properties(layout, schema)?);
        let writer = ArrowWriter::try_new(
            TypeDefinedOrderWriter::new(file),
            schema.clone(),
            properties,
        )
        .map_err(RecordingError::unusable(&context))?;
        Ok(Self {
            context,
            schema: schema.clone(),
            writer,
        })
    }

    /// Adds whole episodes, at most 1024 rows at once, so that pages and row groups end with an episode.
    pub fn write(&mut self, columns: Vec<ArrayRef>) -> Result<(), RecordingError> {
        if columns.iter().all(|column| column.is_empty()) {
            return Ok(());
        }
        let batch = RecordBatch::try_new(self.schema.clone(), columns)
            .map_err(RecordingError::unusable(&self.context))?;
        self.writer
            .write(&batch)
            .map_err(RecordingError::unusable(&self.context))?;
        if self.writer.in_progress_rows() >= ROW_GROUP_ROWS {
            self.end_row_group()?;
        }
        Ok(())
    }

    fn end_row_group(&mut self) -> Result<(), RecordingError> {
        self.writer
            .flush()
            .map_err(RecordingError::unusable(&self.context))
    }

    pub fn finish(mut self) -> Result<(), RecordingError> {
        let metadata = self
            .writer
            .finish()
            .map_err(RecordingError::unusable(&self.context))?;
        let columns = metadata.file_metadata().schema_descr().num_columns();
        let file = self.writer.inner_mut().finish(columns)?;
        Ok(file.sync_all()?)
    }
}

/// The metadata entry with the layout of a table.
pub(super) fn schema_metadata() -> KeyValue {
    layout_metadata(DATASET_SCHEMA)
}

fn layout_metadata(layout: &str) -> KeyValue {
    KeyValue::new("faceoff.schema".to_owned(), layout.to_owned())
}

fn properties(layout: &str, schema: &Schema) -> Result<WriterProperties, RecordingError> {
    let level = ZstdLevel::try_new(ZSTD_LEVEL).map_err(RecordingError::unusable("zstd"))?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .set_max_row_group_row_count(None)
        .set_data_page_row_count_limit(PAGE_ROWS)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(vec![layout_metadata(layout)]));
    for field in schema.fields() {
        let name = field.name().as_str();
        // Measured numbers rarely repeat, but their leading bytes do. Only floats are split by bytes: DuckDB and
        // pyarrow 15 refuse that for integers. Integers count up or are close together.
        let (path, encoding) = match field.data_type() {
            DataType::Float64 => (ColumnPath::from(name), Encoding::BYTE_STREAM_SPLIT),
            DataType::List(item) => {
                let path = vec![name.to_owned(), "list".to_owned(), item.name().clone()];
                (ColumnPath::new(path), Encoding::BYTE_STREAM_SPLIT)
            }
            DataType::UInt32 | DataType::Int64 => {
                (ColumnPath::from(name), Encoding::DELTA_BINARY_PACKED)
            }
            _ => continue,
        };
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path.clone(), encoding);
        // Readers find episodes by the bounds of `task`, `episode` and `step`; bounds of measured numbers would
        // have no use.
        if *field.data_type() != DataType::UInt32 {
            properties = properties.set_column_statistics_enabled(path, EnabledStatistics::None);
        }
    }
    Ok(properties.build())
}
