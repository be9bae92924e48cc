//! Finds the first difference between a recorded table or JSON file and the expected one. Values are compared bit for bit:
//! −0 differs from 0, and a missing value differs from every value.

use super::difference::Difference;
use arrow_array::{
    Array, RecordBatch,
    cast::AsArray,
    types::{Float64Type, Int64Type, UInt32Type},
};
use arrow_schema::DataType;
use serde_json::Value;

/// A cell that differs.
pub(crate) struct CellDifference {
    pub row: usize,
    pub field: String,
    pub recorded: String,
    pub expected: String,
}

/// The first cell, by row and then by column, that differs between `recorded` and `expected`. Columns are matched by
/// name; rows beyond those of `expected` are not compared.
pub(crate) fn first_row_difference(
    recorded: &RecordBatch,
    expected: &RecordBatch,
) -> Option<CellDifference> {
    let schema = expected.schema();
    let mut first: Option<(usize, usize)> = None;
    for (index, field) in schema.fields().iter().enumerate() {
        let rows = first.map_or(expected.num_rows(), |(row, _)| row);
        let column = recorded.column_by_name(field.name());
        let differs = |row: &usize| {
            column.is_none_or(|column| {
                !equal_cells(column.as_ref(), expected.column(index).as_ref(), *row)
            })
        };
        if let Some(row) = (0..rows).find(differs) {
            first = Some((row, index));
        }
    }
    first.map(|(row, index)| {
        let name = schema.field(index).name().clone();
        CellDifference {
            row,
            recorded: recorded.column_by_name(&name).map_or_else(
                || "nothing".to_owned(),
                |column| cell_text(column.as_ref(), row),
            ),
            expected: cell_text(expected.column(index).as_ref(), row),
            field: name,
        }
    })
}

fn equal_cells(a: &dyn Array, b: &dyn Array, row: usize) -> bool {
    if row >= a.len() || a.is_null(row) != b.is_null(row) {
        return false;
    }
    if a.is_null(row) {
        return true;
    }
    match b.data_type() {
        DataType::Float64 => float_bits(a, row) == float_bits(b, row),
        DataType::Int64 => {
            a.as_primitive::<Int64Type>().value(row) == b.as_primitive::<Int64Type>().value(row)
        }
        DataType::UInt32 => {
            a.as_primitive::<UInt32Type>().value(row) == b.as_primitive::<UInt32Type>().value(row)
        }
        DataType::Boolean => a.as_boolean().value(row) == b.as_boolean().value(row),
        DataType::Utf8 => a.as_string::<i32>().value(row) == b.as_string::<i32>().value(row),
        DataType::List(_) => {
            let (a, b) = (a.as_list::<i32>().value(row), b.as_list::<i32>().value(row));
            a.len() == b.len() && (0..a.len()).all(|i| equal_cells(a.as_ref(), b.as_ref(), i))
        }
        other => unreachable!("no table has a column of {other}"),
    }
}

fn float_bits(array: &dyn Array, row: usize) -> u64 {
    array.as_primitive::<Float64Type>().value(row).to_bits()
}

fn cell_text(array: &dyn Array, row: usize) -> String {
    if row >= array.len() || array.is_null(row) {
        return "nothing".to_owned();
    }
    match array.data_type() {
        DataType::Float64 => format!("{:?}", f64::from_bits(float_bits(array, row))),
        DataType::Int64 => array.as_primitive::<Int64Type>().value(row).to_string(),
        DataType::UInt32 => array.as_primitive::<UInt32Type>().value(row).to_string(),
        DataType::Boolean => array.as_boolean().value(row).to_string(),
        DataType::Utf8 => format!("{:?}", array.as_string::<i32>().value(row)),
        _ => "a list with other values".to_owned(),
    }
}

/// The first difference between two JSON files, compared byte for byte.
pub(crate) fn json_difference(
    file: &'static str,
    recorded: &[u8],
    expected: &[u8],
) -> Option<Difference> {
    if recorded == expected {
        return None;
    }
    let parse = serde_json::from_slice::<Value>;
    // Parsed values take many times the space of their text, so the difference in a much longer file is its length.
    let is_comparable = recorded.len() / 2 <= expected.len();
    let parsed = is_comparable.then(|| (parse(recorded), parse(expected)));
    let found = match parsed {
        Some((Ok(recorded), Ok(expected))) => {
            first_json_difference(&recorded, &expected, String::new())
        }
        _ => None,
    };
    let (field, recorded, expected) = found.unwrap_or_else(|| {
        let offset = recorded
            .iter()
            .zip(expected)
            .position(|(a, b)| a != b)
            .unwrap_or_else(|| recorded.len().min(expected.len()));
        (
            format!("byte {offset}"),
            format!("a file of {} bytes", recorded.len()),
            format!("another file of {} bytes", expected.len()),
        )
    });
    Some(Difference {
        file,
        task: None,
        episode: None,
        rally: None,
        step: None,
        field,
        recorded,
        expected,
    })
}

/// The path of the first different value (`path` is that of the given values), its recorded text and its expected text.
fn first_json_difference(
    recorded: &Value,
    expected: &Value,
    path: String,
) -> Option<(String, String, String)> {
    match (recorded, expected) {
        (Value::Object(a), Value::Object(b)) => {
            let missing = a.keys().find(|key| !b.contains_key(*key));
            b.keys().chain(missing).find_map(|key| {
                let key_path = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                first_json_difference(
                    a.get(key).unwrap_or(&Value::Null),
                    b.get(key).unwrap_or(&Value::Null),
                    key_path,
                )
            })
        }
        (Value::Array(a), Value::Array(b)) => (0..a.len().max(b.len())).find_map(|i| {
            first_json_difference(
                a.get(i).unwrap_or(&Value::Null),
                b.get(i).unwrap_or(&Value::Null),
                format!("{path}[{i}]"),
            )
        }),
        // Compare as text, so that −0 differs from 0.
        (a, b) => {
            let (a, b) = (a.to_string(), b.to_string());
            (a != b).then_some((path, a, b))
        }
    }
}
