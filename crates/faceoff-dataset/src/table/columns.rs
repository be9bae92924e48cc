//! Columns of floating-point numbers of a table.

use arrow_array::{ArrayRef, builder::Float64Builder};
use arrow_schema::{DataType, Field};
use faceoff_episode::StateColumns;
use faceoff_types::RecordingColumn;
use std::sync::Arc;

/// Columns of numbers that are filled row by row, from left to right.
#[derive(Debug, Default)]
pub(super) struct FloatColumns {
    fields: Vec<Field>,
    builders: Vec<Float64Builder>,
    /// Index of the column of the next value.
    next: usize,
}

impl FloatColumns {
    /// Adds columns to the right.
    pub fn with<I: IntoIterator<Item = String>>(mut self, names: I, nullable: bool) -> Self {
        for name in names {
            self.fields
                .push(Field::new(name, DataType::Float64, nullable));
            self.builders.push(Float64Builder::new());
        }
        self
    }

    /// Adds columns of a competition's recordings to the right, with names after `prefix`. `nullable`: rows may have no values at all.
    pub fn with_recorded(
        mut self,
        prefix: &str,
        columns: &[RecordingColumn],
        nullable: bool,
    ) -> Self {
        for column in columns {
            let name = format!("{prefix}{}", column.name);
            self = self.with([name], nullable || column.optional);
        }
        self
    }

    /// The columns' names and types.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Ends the row with nulls in the columns that are left.
    pub fn end_short_row(&mut self) {
        self.put_absent(self.builders.len().saturating_sub(self.next));
        self.end_row();
    }

    /// Appends values to the row, null for `None`.
    pub fn put_optional(&mut self, values: &[Option<f64>]) {
        for value in values {
            self.builders[self.next].append_option(*value);
            self.next += 1;
        }
    }

    /// Ends the row. Panics if the row is incomplete, which is a bug of this crate.
    pub fn end_row(&mut self) {
        assert_eq!(
            self.next,
            self.builders.len(),
            "every column of a row is filled"
        );
        self.next = 0;
    }

    /// Removes and returns the rows so far.
    pub fn take(&mut self) -> Vec<ArrayRef> {
        self.builders
            .iter_mut()
            .map(|builder| Arc::new(builder.finish()) as ArrayRef)
            .collect()
    }
}

impl StateColumns for FloatColumns {
    fn put(&mut self, values: &[f64]) {
        for value in values {
            self.builders[self.next].append_value(*value);
            self.next += 1;
        }
    }

    fn put_absent(&mut self, count: usize) {
        for _ in 0..count {
            self.builders[self.next].append_null();
            self.next += 1;
        }
    }
}

/// Values of a state that is written later.
#[derive(Debug, Default)]
pub(super) struct StateValues(pub Vec<Option<f64>>);

impl StateColumns for StateValues {
    fn put(&mut self, values: &[f64]) {
        self.0.extend(values.iter().copied().map(Some));
    }

    fn put_absent(&mut self, count: usize) {
        self.0.extend(std::iter::repeat_n(None, count));
    }
}
