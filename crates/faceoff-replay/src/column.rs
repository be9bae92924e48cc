//! The columns of a clip. Numbers are stored as *counts*, integer multiples of the column's resolution, and written as
//! differences between neighbours, which are small.

use crate::error::ReplayError;

/// A column: its values are multiples of `scale`.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    /// SI unit of the values.
    pub unit: String,
    /// The value of one count, in that unit.
    pub scale: f64,
    /// Order of the differences that are written: 0 (the counts themselves), 1 or 2 (differences of the differences).
    pub order: u8,
    /// The sample of the first value, from 0 at the clip's start: 1 in columns of answers, which the initial state has not.
    pub first: u32,
    /// The values, in units of `scale`.
    pub counts: Vec<i64>,
    /// Counts per unit: 1 / `scale`.
    per_unit: f64,
}

/// Largest magnitude of a count: far beyond simulated values, and exact as a float.
const MAX_COUNT: f64 = 1e15;

impl Column {
    pub(crate) fn new(name: impl Into<String>, unit: &str, scale: f64, order: u8) -> Self {
        Self {
            name: name.into(),
            unit: unit.to_owned(),
            scale,
            order,
            first: 0,
            // Enough for most episodes, so that columns need not grow.
            counts: Vec::with_capacity(256),
            per_unit: 1.0 / scale,
        }
    }

    /// Sets the sample of the first value, from 0 at the clip's start.
    pub(crate) fn beginning_at(self, first: u32) -> Self {
        Self { first, ..self }
    }

    /// Adds a value, rounded; NaN is stored as 0.
    pub(crate) fn push(&mut self, value: f64) {
        // Hot path: avoids a division and a call of a rounding function.
        let count = (value * self.per_unit).clamp(-MAX_COUNT, MAX_COUNT);
        #[expect(clippy::cast_possible_truncation, reason = "clamped to ±1e15 before")]
        let rounded = (count + 0.5_f64.copysign(count)) as i64;
        self.counts.push(rounded);
    }

    #[expect(clippy::cast_precision_loss, reason = "counts are at most 1e15")]
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.counts.iter().map(|count| *count as f64 * self.scale)
    }

    /// Appends the differences as integers of variable length (varints).
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        // The previous count and the one before that.
        let (mut previous, mut second_previous) = (0_i64, 0_i64);
        for count in &self.counts {
            let difference = match self.order {
                0 => *count,
                1 => count - previous,
                _ => count - 2 * previous + second_previous,
            };
            (second_previous, previous) = (previous, *count);
            write_varint(out, difference);
        }
    }

    /// Reads `count` numbers written by [`Column::write`], which must be all of `bytes`.
    pub(crate) fn read(&mut self, bytes: &[u8], count: usize) -> Result<(), ReplayError> {
        let wrong =
            |reason: &str| ReplayError::unreadable(format!("the column {:?}", self.name), reason);
        // A number takes at least a byte, so a wrong count in a header cannot cause a large allocation.
        if count > bytes.len() {
            return Err(wrong("it is cut off"));
        }
        let mut rest = bytes;
        let mut counts = Vec::with_capacity(count);
        let (mut previous, mut second_previous) = (0_i64, 0_i64);
        for _ in 0..count {
            let difference = read_varint(&mut rest).ok_or_else(|| wrong("it is cut off"))?;
            let value = match self.order {
                0 => Some(difference),
                1 => previous.checked_add(difference),
                _ => previous
                    .checked_mul(2)
                    .and_then(|twice| twice.checked_sub(second_previous))
                    .and_then(|expected| expected.checked_add(difference)),
            };
            let value = value.ok_or_else(|| wrong("its numbers are too large"))?;
            (second_previous, previous) = (previous, value);
            counts.push(value);
        }
        if !rest.is_empty() {
            return Err(wrong("it is longer than its header states"));
        }
        self.counts = counts;
        Ok(())
    }
}

/// Zig-zag encoding, then seven bits per byte, lowest first.
fn write_varint(out: &mut Vec<u8>, value: i64) {
    let mut rest = ((value << 1) ^ (value >> 63)).cast_unsigned();
    loop {
        let [low, ..] = rest.to_le_bytes();
        rest >>= 7;
        if rest == 0 {
            out.push(low & 0x7f);
            return;
        }
        out.push(low | 0x80);
    }
}

fn read_varint(bytes: &mut &[u8]) -> Option<i64> {
    let mut value = 0_u64;
    for shift in (0..64).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f).checked_shl(shift)?;
        if byte & 0x80 == 0 {
            return Some((value >> 1).cast_signed() ^ -(value & 1).cast_signed());
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_back(column: &Column) -> Column {
        let mut bytes = Vec::new();
        column.write(&mut bytes);
        let mut read = Column {
            counts: Vec::new(),
            ..column.clone()
        };
        read.read(&bytes, column.counts.len()).unwrap();
        read
    }

    #[test]
    fn column_round_trips_in_all_orders() {
        for order in 0..3 {
            let mut column = Column::new("q_1", "rad", 1e-4, order);
            for value in [0.0, 1.0, -3.2, 1e9, -1e9, f64::NAN, f64::INFINITY, 0.00004] {
                column.push(value);
            }
            assert_eq!(read_back(&column), column, "order {order}");
            assert_eq!(column.counts[7], 0, "rounded to the nearest");
            assert_eq!(column.values().nth(1), Some(1.0));
        }
    }

    #[test]
    fn column_of_wrong_length_is_refused() {
        let mut column = Column::new("q_1", "rad", 1e-4, 1);
        (0..50).for_each(|i| column.push(f64::from(i) * 0.3));
        let mut bytes = Vec::new();
        column.write(&mut bytes);
        let read = |bytes: &[u8], count| {
            let error = column.clone().read(bytes, count).unwrap_err();
            error.to_string()
        };
        assert!(read(&bytes[..bytes.len() - 1], 50).contains("cut off"));
        assert!(read(&bytes, 49).contains("longer"));
        assert!(read(&bytes, usize::MAX).contains("cut off"));
        assert!(read(&[0xff; 11], 1).contains("cut off"));
    }
}
