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

/// Rows after which a row group is closed; bounds the memory of a writer.
const ROW_GROUP_ROWS: usize = 32_768;
/// Rows after which a page is closed. Whoever reads one episode unpacks a page or two per column;
/// smaller ones would cost the whole dataset more than they save there.
const PAGE_ROWS: usize = 1024;
/// Most of what a recording costs is the search for repetitions in bytes that have none; higher levels search
/// longer and gain a percent.
const ZSTD_LEVEL: i32 = 1;

/// One Parquet file being written.
pub(crate) struct TableWriter {
    what: String,
    schema: SchemaRef,
    writer: ArrowWriter<File>,
}

impl TableWriter {
    pub fn create(path: &Path, schema: &SchemaRef) -> Result<Self, RecordingError> {
        Self::create_as(DATASET_SCHEMA, path, schema)
    }

    /// A table of this layout.
    pub fn create_as(
        layout: &str,
        path: &Path,
        schema: &SchemaRef,
    ) -> Result<Self, RecordingError> {
        Self::new_as(layout, File::create(path)?, schema)
    }

    pub fn new(file: File, schema: &SchemaRef) -> Result<Self, RecordingError> {
        Self::new_as(DATASET_SCHEMA, file, schema)
    }

    fn new_as(layout: &str, file: File, schema: &SchemaRef) -> Result<Self, RecordingError> {
        let what = format!("writing {}", file.path().display());
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties(layout, schema)?))
            .map_err(RecordingError::unusable(&what))?;
        Ok(Self {
            what,
            schema: schema.clone(),
            writer,
        })
    }

    /// Adds whole episodes, at most 1024 rows at once: pages and row groups then end where an episode
    /// does.
    pub fn write(&mut self, columns: Vec<ArrayRef>) -> Result<(), RecordingError> {
        if columns.iter().all(|column| column.is_empty()) {
            return Ok(());
        }
        let batch = RecordBatch::try_new(self.schema.clone(), columns)
            .map_err(RecordingError::unusable(&self.what))?;
        self.writer
            .write(&batch)
            .map_err(RecordingError::unusable(&self.what))?;
        if self.writer.in_progress_rows() >= ROW_GROUP_ROWS {
            self.end_row_group()?;
        }
        Ok(())
    }

    fn end_row_group(&mut self) -> Result<(), RecordingError> {
        self.writer
            .flush()
            .map_err(RecordingError::unusable(&self.what))
    }

    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.writer
            .finish()
            .map_err(RecordingError::unusable(&self.what))?;
        Ok(self.writer.inner().sync_all()?)
    }
}

/// The key under which a table names its layout.
pub(super) fn schema_metadata() -> KeyValue {
    named_layout(DATASET_SCHEMA)
}

fn named_layout(layout: &str) -> KeyValue {
    KeyValue::new("faceoff.schema".to_owned(), layout.to_owned())
}

fn properties(layout: &str, schema: &Schema) -> Result<WriterProperties, RecordingError> {
    let level = ZstdLevel::try_new(ZSTD_LEVEL).map_err(RecordingError::unusable("zstd"))?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .set_max_row_group_row_count(None)
        .set_data_page_row_count_limit(PAGE_ROWS)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(vec![named_layout(layout)]));
    for field in schema.fields() {
        let name = field.name().as_str();
        // Measured numbers hardly repeat, but their leading bytes do. Only floats are split by bytes:
        // DuckDB and pyarrow 15 refuse that for integers. Those count up or lie close together.
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
        // Readers find episodes by the bounds of `task`, `episode` and `step`; those of measured
        // numbers would only be longer.
        if *field.data_type() != DataType::UInt32 {
            properties = properties.set_column_statistics_enabled(path, EnabledStatistics::None);
        }
    }
    Ok(properties.build())
}
