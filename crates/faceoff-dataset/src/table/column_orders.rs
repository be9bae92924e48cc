//! Column orders that older Parquet readers know. The footer of a Parquet file has for each column an *order*, by which the bounds in its
//! statistics compare values.
//!
//! Since version 60 the crate `parquet` declares IEEE 754's total order for floating-point columns. Readers that know only Parquet's older
//! *type-defined order* refuse such a file: polars before 2.0 does, with "Invalid thrift". Columns of floating-point numbers have no
//! statistics here, so the type-defined order is as right. The crate has no option for it.

use std::io::{self, Write};

/// Bytes at the end of a file after the column orders: the end of the footer's struct, the footer's length, the format's name.
const AFTER_ORDERS: usize = 1 + 4 + 4;
/// Bytes at the end that are written only when the file is complete: enough for the orders of 1362 columns and what follows them.
const HELD_BACK_BYTES: usize = 4096;
/// `ColumnOrder` in Thrift's compact protocol: the header of the union's field, an empty struct, the end of the union.
const TYPE_DEFINED_ORDER: [u8; 3] = [0x1c, 0, 0];
const IEEE_754_TOTAL_ORDER: [u8; 3] = [0x2c, 0, 0];

/// Passes a Parquet file on to `inner`, except for its end. When the file is complete, the end is written with type-defined orders.
#[derive(Debug)]
pub struct TypeDefinedOrderWriter<W> {
    inner: W,
    /// The last bytes so far.
    end: Vec<u8>,
}

impl<W: Write> TypeDefinedOrderWriter<W> {
    pub fn new(inner: W) -> Self {
        Self {
            inner,
            end: Vec::new(),
        }
    }

    /// Writes the end of a complete file of `columns` columns, and returns the inner writer.
    ///
    /// # Errors
    /// If the end cannot be written, or the footer does not end with so many column orders.
    pub fn finish(&mut self, columns: usize) -> io::Result<&mut W> {
        let len = columns * TYPE_DEFINED_ORDER.len();
        let start = self
            .end
            .len()
            .checked_sub(len + AFTER_ORDERS)
            .ok_or(io::ErrorKind::UnexpectedEof)?;
        for order in self.end[start..][..len].chunks_exact_mut(TYPE_DEFINED_ORDER.len()) {
            if *order == IEEE_754_TOTAL_ORDER {
                order.copy_from_slice(&TYPE_DEFINED_ORDER);
            } else if *order != TYPE_DEFINED_ORDER {
                return Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    format!("expected a column order at the end of the footer, got {order:x?}"),
                ));
            }
        }
        self.inner.write_all(&self.end)?;
        self.end.clear();
        self.inner.flush()?;
        Ok(&mut self.inner)
    }
}

impl<W: Write> Write for TypeDefinedOrderWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let excess = (self.end.len() + bytes.len()).saturating_sub(HELD_BACK_BYTES);
        let from_end = excess.min(self.end.len());
        self.inner.write_all(&self.end[..from_end])?;
        self.end.drain(..from_end);
        let (passed, kept) = bytes.split_at(excess - from_end);
        self.inner.write_all(passed)?;
        self.end.extend_from_slice(kept);
        Ok(bytes.len())
    }

    /// Flushes what was passed on; the end is written by [`Self::finish`].
    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end_of(orders: &[[u8; 3]]) -> Vec<u8> {
        let mut end = orders.concat();
        end.extend([0; 5]);
        end.extend(b"PAR1");
        end
    }

    fn written(pieces: &[&[u8]], columns: usize) -> io::Result<Vec<u8>> {
        let mut writer = TypeDefinedOrderWriter::new(Vec::new());
        for piece in pieces {
            writer.write_all(piece)?;
        }
        writer.finish(columns).cloned()
    }

    #[test]
    fn total_orders_become_type_defined_orders() {
        let end = end_of(&[
            TYPE_DEFINED_ORDER,
            IEEE_754_TOTAL_ORDER,
            IEEE_754_TOTAL_ORDER,
        ]);
        for size in [1, 100, HELD_BACK_BYTES, 3 * HELD_BACK_BYTES] {
            let body = vec![0x2c; size];
            let mut whole = body.clone();
            whole.extend(&end);
            let mut expected = body;
            expected.extend(end_of(&[TYPE_DEFINED_ORDER; 3]));
            assert_eq!(written(&[&whole], 3).unwrap(), expected);
            let bytes: Vec<&[u8]> = whole.chunks(7).collect();
            assert_eq!(written(&bytes, 3).unwrap(), expected);
        }
    }

    #[test]
    fn other_ends_are_refused() {
        let unknown = end_of(&[TYPE_DEFINED_ORDER, [0x3c, 0, 0]]);
        assert!(written(&[&unknown], 2).is_err());
        assert!(written(&[&end_of(&[TYPE_DEFINED_ORDER])], 2).is_err());
    }
}
