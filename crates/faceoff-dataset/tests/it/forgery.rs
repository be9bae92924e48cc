//! Helpers that forge recordings: they change a value and update the hashes.

use crate::recordings::table;
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int64Array, ListArray, RecordBatch, StringArray,
    UInt32Array,
    builder::{Float64Builder, ListBuilder},
    cast::AsArray,
};
use arrow_schema::{DataType, Field};
use parquet::arrow::ArrowWriter;
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    sync::Arc,
};
use tempfile::TempDir;

/// A copy of a recording for forgery.
pub struct Forgery {
    pub dir: TempDir,
}

impl Forgery {
    pub fn copy_of(folder: &Path) -> Self {
        let dir = tempfile::tempdir().unwrap();
        for entry in folder.read_dir().unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), dir.path().join(entry.file_name())).unwrap();
        }
        Self { dir }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Rewrites a table.
    pub fn change_table(&self, name: &str, change: impl FnOnce(RecordBatch) -> RecordBatch) {
        let path = self.path(name);
        let batch = change(table(&path));
        let mut writer =
            ArrowWriter::try_new(File::create(&path).unwrap(), batch.schema(), None).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
    }

    /// Replaces the first occurrence of `from` in a text file.
    pub fn replace_text(&self, name: &str, from: &str, to: &str) {
        let path = self.path(name);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{name} lacks {from:?}: {text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
    }

    /// Updates the manifest's sizes and hashes, so that only the simulation can find the forgery.
    pub fn update_manifest(self) -> Self {
        let path = self.path("manifest.json");
        // Parsed as plain JSON, which works for any layout.
        let mut manifest: serde_json::Value =
            serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        for (name, digest) in manifest["files"].as_object_mut().unwrap() {
            let bytes = fs::read(self.path(name)).unwrap();
            digest["bytes"] = bytes.len().into();
            digest["blake3"] = blake3::hash(&bytes).to_hex().to_string().into();
        }
        fs::write(&path, serde_json::to_vec_pretty(&manifest).unwrap()).unwrap();
        self
    }
}

/// The column with the lowest bit of one value flipped.
fn flip(column: &ArrayRef, row: usize) -> ArrayRef {
    let flip_float = |i: usize, value: f64| {
        f64::from_bits(if i == row {
            value.to_bits() ^ 1
        } else {
            value.to_bits()
        })
    };
    match column.data_type() {
        DataType::Float64 => {
            let column: &Float64Array = column.as_primitive();
            let flipped = (0..column.len())
                .map(|i| column.is_valid(i).then(|| flip_float(i, column.value(i))));
            Arc::new(flipped.collect::<Float64Array>())
        }
        DataType::UInt32 => {
            let column: &UInt32Array = column.as_primitive();
            let flipped = column.values().iter().enumerate();
            Arc::new(UInt32Array::from_iter_values(
                flipped.map(|(i, value)| if i == row { value ^ 1 } else { *value }),
            ))
        }
        DataType::Int64 => {
            let column: &Int64Array = column.as_primitive();
            let flipped = column.iter().enumerate();
            Arc::new(
                flipped
                    .map(|(i, value)| value.map(|value| if i == row { value ^ 1 } else { value }))
                    .collect::<Int64Array>(),
            )
        }
        DataType::Boolean => {
            let column: &BooleanArray = column.as_boolean();
            let flipped = (0..column.len()).map(|i| Some(column.value(i) ^ (i == row)));
            Arc::new(flipped.collect::<BooleanArray>())
        }
        DataType::Utf8 => {
            let column: &StringArray = column.as_string();
            let flipped = (0..column.len()).map(|i| {
                let text = column.is_valid(i).then(|| column.value(i).to_owned());
                if i != row {
                    return text;
                }
                let mut bytes = text.unwrap_or_else(|| "c".to_owned()).into_bytes();
                *bytes.last_mut().unwrap() ^= 1;
                Some(String::from_utf8(bytes).unwrap())
            });
            Arc::new(flipped.collect::<StringArray>())
        }
        DataType::List(item) => {
            let column: &ListArray = column.as_list();
            let mut out = ListBuilder::new(Float64Builder::new()).with_field(item.clone());
            for i in 0..column.len() {
                let values = column.value(i);
                let values: &Float64Array = values.as_primitive();
                for (index, value) in values.values().iter().enumerate() {
                    // The last number of an action is the velocity of the last joint.
                    let last = index + 1 == values.len();
                    out.values()
                        .append_value(if last { flip_float(i, *value) } else { *value });
                }
                out.append(true);
            }
            Arc::new(out.finish())
        }
        other => panic!("{other}"),
    }
}

/// The table with one value changed, and with nullable columns, since a forger may ignore nullability.
pub fn flipped(batch: &RecordBatch, name: &str, row: usize) -> RecordBatch {
    let schema = batch.schema();
    let (index, _) = schema.column_with_name(name).unwrap();
    let mut columns = batch.columns().to_vec();
    columns[index] = flip(&columns[index], row);
    let fields: Vec<Field> = schema
        .fields()
        .iter()
        .map(|field| Field::clone(field).with_nullable(true))
        .collect();
    RecordBatch::try_new(Arc::new(arrow_schema::Schema::new(fields)), columns).unwrap()
}

/// Concatenates batches.
pub fn concat(parts: &[RecordBatch]) -> RecordBatch {
    // Written to a file and read again, as a forger would.
    let file = tempfile::NamedTempFile::new().unwrap();
    let mut writer = ArrowWriter::try_new(file.reopen().unwrap(), parts[0].schema(), None).unwrap();
    for part in parts {
        writer.write(part).unwrap();
    }
    writer.close().unwrap();
    table(file.path())
}
