//! `faceoff dataset slice`: the control steps of one episode as CSV or JSON lines.

use crate::competition::{competition, parse_task};
use crate::terminal;
use anyhow::Context;
use arrow_array::{
    Array,
    cast::AsArray,
    types::{Float64Type, Int64Type, UInt32Type},
};
use arrow_schema::DataType;
use clap::{Args, ValueEnum};
use faceoff_dataset::Dataset;
use faceoff_types::Task;
use serde_json::{Map, Value};
use std::{
    fs::File,
    io::{BufWriter, Write},
    ops::Range,
    path::PathBuf,
    str::FromStr,
};

/// Prints the control steps of an episode.
#[derive(Debug, Args)]
pub struct SliceArgs {
    /// dataset.zip, the folder it was unpacked to, or the folder of `faceoff eval --out`
    dataset: PathBuf,
    /// The task
    #[arg(long, value_parser = parse_task)]
    task: Task,
    /// The episode, from 0
    #[arg(long, value_name = "N")]
    episode: u32,
    /// Only these control steps, from A to before B
    #[arg(long, value_name = "A..B")]
    steps: Option<StepRange>,
    /// Only these columns, in this order [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    columns: Option<Vec<String>>,
    /// Output format
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// Write to a file instead of standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A header and a line per step; an action is a JSON array, a missing value is empty
    Csv,
    /// A JSON object per line
    Jsonl,
}

/// A range of steps, `A..B`; either end may be left out.
#[derive(Debug, Clone, PartialEq, Eq)]
struct StepRange(Range<u32>);

impl FromStr for StepRange {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let format_error = || format!("expected A..B, such as 10..20, got {s:?}");
        let (from, to) = s.split_once("..").ok_or_else(format_error)?;
        let bound = |text: &str, default: u32| match text {
            "" => Ok(default),
            number => number.parse().map_err(|_| format_error()),
        };
        Ok(Self(bound(from, 0)?..bound(to, u32::MAX)?))
    }
}

impl SliceArgs {
    pub fn run(self) -> anyhow::Result<()> {
        let dataset = Dataset::open_lazily(&self.dataset, competition())?;
        // The step numbers are always read, because `--steps` selects by them.
        let columns = self.columns.as_ref().map(|names| {
            let step = "step".to_owned();
            names.iter().cloned().chain([step]).collect::<Vec<_>>()
        });
        let rows = dataset.episode(self.task, self.episode, columns.as_deref())?;
        let names = self.columns.unwrap_or_else(|| {
            let schema = rows.schema();
            schema
                .fields()
                .iter()
                .map(|field| field.name().clone())
                .collect()
        });
        let mut out: Box<dyn Write> = match &self.out {
            Some(path) => Box::new(BufWriter::new(
                File::create(path).with_context(|| format!("creating {}", path.display()))?,
            )),
            None => Box::new(terminal::stdout()),
        };
        if self.format == Format::Csv {
            writeln!(out, "{}", names.join(","))?;
        }
        let steps = self.steps.map_or(0..u32::MAX, |steps| steps.0);
        let step_numbers = rows["step"].as_primitive::<UInt32Type>();
        let columns: Vec<(&str, &dyn Array)> = names
            .iter()
            .map(|name| (name.as_str(), &*rows[name.as_str()]))
            .collect();
        for row in 0..rows.num_rows() {
            if steps.contains(&step_numbers.value(row)) {
                write_row(&mut out, self.format, &columns, row)?;
            }
        }
        Ok(out.flush()?)
    }
}

fn write_row(
    out: &mut dyn Write,
    format: Format,
    columns: &[(&str, &dyn Array)],
    row: usize,
) -> anyhow::Result<()> {
    let cells = columns
        .iter()
        .map(|(name, column)| (*name, cell_value(*column, row)));
    match format {
        Format::Jsonl => {
            let object: Map<String, Value> =
                cells.map(|(name, cell)| (name.to_owned(), cell)).collect();
            writeln!(out, "{}", Value::Object(object))?;
        }
        Format::Csv => {
            let cells: Vec<String> = cells
                .map(|(_, cell)| match cell {
                    Value::Null => String::new(),
                    Value::String(text) => text,
                    list @ Value::Array(_) => format!("\"{list}\""),
                    other => other.to_string(),
                })
                .collect();
            writeln!(out, "{}", cells.join(","))?;
        }
    }
    Ok(())
}

/// The value of a cell. Numbers have the fewest digits that round-trip to the same bits.
fn cell_value(column: &dyn Array, row: usize) -> Value {
    if column.is_null(row) {
        return Value::Null;
    }
    match column.data_type() {
        DataType::Float64 => column.as_primitive::<Float64Type>().value(row).into(),
        DataType::Int64 => column.as_primitive::<Int64Type>().value(row).into(),
        DataType::UInt32 => column.as_primitive::<UInt32Type>().value(row).into(),
        DataType::Utf8 => column.as_string::<i32>().value(row).into(),
        DataType::List(_) => {
            let values = column.as_list::<i32>().value(row);
            (0..values.len()).map(|i| cell_value(&values, i)).collect()
        }
        other => format!("{other}").into(),
    }
}
