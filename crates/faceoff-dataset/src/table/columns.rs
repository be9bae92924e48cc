//! Columns of floating-point numbers of a table.

use arrow_array::{ArrayRef, builder::Float64Builder};
use arrow_schema::{DataType, Field};
use faceoff_sim::EpisodeState;
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

    /// Adds the columns of the simulation's true state (without observation noise) to the right; `prefix` begins their
    /// names. The filtered velocities are left out: they follow from the other columns, and would add a tenth to the size
    /// of a dataset.
    pub fn with_state(self, prefix: &str) -> Self {
        let name = |suffix: &str| format!("{prefix}{suffix}");
        self.with(
            ["x", "y", "yaw", "vx", "vy", "yaw_rate"].map(|c| name(&format!("puck_{c}"))),
            false,
        )
        .with(joints(&name("q")), false)
        .with(joints(&name("dq")), false)
        .with([name("universal_1"), name("universal_2")], false)
        .with(["x", "y", "z"].map(|c| name(&format!("ee_{c}"))), false)
        .with(joints(&name("opponent_q")), true)
        .with(
            ["x", "y", "z"].map(|c| name(&format!("opponent_ee_{c}"))),
            true,
        )
    }

    /// The columns' names and types.
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Appends values to the row.
    pub fn put(&mut self, values: &[f64]) {
        for value in values {
            self.builders[self.next].append_value(*value);
            self.next += 1;
        }
    }

    /// Appends values to the row, null for `None`.
    pub fn put_optional<const N: usize>(&mut self, values: Option<[f64; N]>) {
        match values {
            Some(values) => self.put(&values),
            None => self.put_absent(N),
        }
    }

    /// Appends `count` nulls to the row.
    pub fn put_absent(&mut self, count: usize) {
        for _ in 0..count {
            self.builders[self.next].append_null();
            self.next += 1;
        }
    }

    /// Appends the values of the columns of [`FloatColumns::with_state`].
    pub fn put_state(&mut self, state: &EpisodeState) {
        let EpisodeState {
            puck,
            q,
            dq,
            dq_filtered: _,
            universal,
            ee,
            opponent_q,
            opponent_ee,
        } = state;
        self.put(puck);
        self.put(q);
        self.put(dq);
        self.put(universal);
        self.put(ee);
        self.put_optional(*opponent_q);
        self.put_optional(*opponent_ee);
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

/// `name_1` … `name_7`.
pub(super) fn joints(name: &str) -> [String; 7] {
    [1, 2, 3, 4, 5, 6, 7].map(|joint| format!("{name}_{joint}"))
}
