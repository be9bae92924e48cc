use crate::PlatformFault;
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, Schema, SchemaRef};
use faceoff_wire::dataset::DATASET_SCHEMA;
use parquet::{
    arrow::{
        ArrowWriter, ProjectionMask,
        arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder},
    },
    basic::{Compression, Encoding, ZstdLevel},
    column::writer::ColumnCloseResult,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
        reader::{FileReader, SerializedFileReader},
        writer::SerializedFileWriter,
    },
    schema::types::ColumnPath,
};
use std::{
    fs::File,
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Rows after which a row group is closed; bounds the memory of a writer.
const ROW_GROUP_ROWS: usize = 32_768;
/// The first level that compresses the streams of leading and of trailing bytes apart; higher ones
/// gain less than a percent.
const ZSTD_LEVEL: i32 = 3;

/// One Parquet file being written.
pub(super) struct TableWriter {
    path: PathBuf,
    schema: SchemaRef,
    writer: ArrowWriter<File>,
}

impl TableWriter {
    pub fn create(path: &Path, schema: &SchemaRef) -> Result<Self, PlatformFault> {
        let file = File::create(path)
            .map_err(PlatformFault::io(format!("creating {}", path.display())))?;
        let writer =
            ArrowWriter::try_new(file, schema.clone(), Some(properties(schema)?)).map_err(
                PlatformFault::recording(format!("creating {}", path.display())),
            )?;
        Ok(Self {
            path: path.to_owned(),
            schema: schema.clone(),
            writer,
        })
    }

    pub fn write(&mut self, columns: Vec<ArrayRef>) -> Result<(), PlatformFault> {
        if columns.iter().all(|column| column.is_empty()) {
            return Ok(());
        }
        let writing = || format!("writing {}", self.path.display());
        let batch = RecordBatch::try_new(self.schema.clone(), columns)
            .map_err(PlatformFault::recording(writing()))?;
        self.writer
            .write(&batch)
            .map_err(PlatformFault::recording(writing()))
    }

    pub fn finish(mut self) -> Result<(), PlatformFault> {
        let writing = format!("writing {}", self.path.display());
        self.writer
            .finish()
            .map_err(PlatformFault::recording(&writing))?;
        self.writer
            .inner()
            .sync_all()
            .map_err(PlatformFault::io(writing))
    }
}

/// The key under which a table names its layout.
fn schema_metadata() -> KeyValue {
    KeyValue::new("faceoff.schema".to_owned(), DATASET_SCHEMA.to_owned())
}

fn properties(schema: &Schema) -> Result<WriterProperties, PlatformFault> {
    let level = ZstdLevel::try_new(ZSTD_LEVEL).map_err(PlatformFault::recording("zstd"))?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .set_max_row_group_row_count(Some(ROW_GROUP_ROWS))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(vec![schema_metadata()]));
    for field in schema.fields() {
        // Measured numbers hardly repeat, but their leading bytes do; numbers of steps count up.
        let (path, encoding) = match field.data_type() {
            DataType::Float64 | DataType::Int64 => (
                ColumnPath::from(field.name().as_str()),
                Encoding::BYTE_STREAM_SPLIT,
            ),
            DataType::List(item) => (
                ColumnPath::new(vec![
                    field.name().clone(),
                    "list".to_owned(),
                    item.name().clone(),
                ]),
                Encoding::BYTE_STREAM_SPLIT,
            ),
            DataType::UInt32 => {
                let path = ColumnPath::from(field.name().as_str());
                properties = properties
                    .set_column_dictionary_enabled(path.clone(), false)
                    .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
                continue;
            }
            _ => continue,
        };
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path.clone(), encoding)
            .set_column_statistics_enabled(path, EnabledStatistics::None);
    }
    Ok(properties.build())
}

/// Writes the row groups of several files of one layout as one file, their bytes as they are.
pub(crate) fn join<W: Write + Send>(paths: &[PathBuf], out: W) -> Result<(), PlatformFault> {
    let Some(first) = paths.first() else {
        return Err(PlatformFault::Recording("nothing to join".to_owned()));
    };
    let schema = {
        let reader = open(first)?;
        reader
            .metadata()
            .file_metadata()
            .schema_descr()
            .root_schema_ptr()
    };
    let arrow_schema = ParquetRecordBatchReaderBuilder::try_new(open_file(first)?)
        .map_err(PlatformFault::recording(format!(
            "reading {}",
            first.display()
        )))?
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .cloned();
    let properties = WriterProperties::builder()
        .set_key_value_metadata(arrow_schema)
        .set_offset_index_disabled(true)
        .build();
    let joining = || PlatformFault::recording("joining the recordings");
    let mut writer =
        SerializedFileWriter::new(out, schema.clone(), Arc::new(properties)).map_err(joining())?;
    for path in paths {
        let reader = open(path)?;
        let metadata = reader.metadata();
        if metadata.file_metadata().schema_descr().root_schema() != &*schema {
            return Err(PlatformFault::Recording(format!(
                "{} has another layout than {}",
                path.display(),
                first.display()
            )));
        }
        let file = open_file(path)?;
        for group in metadata.row_groups() {
            let mut out = writer.next_row_group().map_err(joining())?;
            for column in group.columns() {
                let close = ColumnCloseResult {
                    bytes_written: column.compressed_size().unsigned_abs(),
                    rows_written: group.num_rows().unsigned_abs(),
                    metadata: column.clone(),
                    bloom_filter: None,
                    column_index: None,
                    offset_index: None,
                };
                out.append_column(&file, close).map_err(joining())?;
            }
            out.close().map_err(joining())?;
        }
    }
    writer.close().map_err(joining())?;
    Ok(())
}

/// Reads the named columns, batch by batch.
pub(crate) fn read(path: &Path, names: &[&str]) -> Result<ParquetRecordBatchReader, PlatformFault> {
    let reading = || PlatformFault::recording(format!("reading {}", path.display()));
    let builder = ParquetRecordBatchReaderBuilder::try_new(open_file(path)?).map_err(reading())?;
    let mask = ProjectionMask::columns(builder.parquet_schema(), names.iter().copied());
    builder
        .with_projection(mask)
        .with_batch_size(4096)
        .build()
        .map_err(reading())
}

fn open_file(path: &Path) -> Result<File, PlatformFault> {
    File::open(path).map_err(PlatformFault::io(format!("opening {}", path.display())))
}

fn open(path: &Path) -> Result<SerializedFileReader<File>, PlatformFault> {
    SerializedFileReader::new(open_file(path)?).map_err(PlatformFault::recording(format!(
        "reading {}",
        path.display()
    )))
}
