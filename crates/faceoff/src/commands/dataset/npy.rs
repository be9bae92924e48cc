//! NumPy's `.npy`, version 1.0: a header of text and little-endian doubles.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

/// An array of doubles of known shape, written row by row.
pub(super) struct NpyWriter {
    out: BufWriter<File>,
    missing: u64,
}

impl NpyWriter {
    pub fn create(path: &Path, shape: &[u64]) -> io::Result<Self> {
        let mut out = BufWriter::new(File::create(path)?);
        let dims: String = shape.iter().map(|length| format!("{length}, ")).collect();
        let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({dims}), }}");
        // Magic, version, length, header and the newline together fill blocks of 64 bytes.
        while (10 + header.len() + 1) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let length = u16::try_from(header.len()).map_err(io::Error::other)?;
        out.write_all(b"\x93NUMPY\x01\x00")?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(header.as_bytes())?;
        Ok(Self {
            out,
            missing: shape.iter().product(),
        })
    }

    pub fn push(&mut self, number: f64) -> io::Result<()> {
        self.missing = self
            .missing
            .checked_sub(1)
            .ok_or_else(|| io::Error::other("more numbers than the array's shape holds"))?;
        self.out.write_all(&number.to_le_bytes())
    }

    pub fn finish(mut self) -> io::Result<()> {
        if self.missing > 0 {
            return Err(io::Error::other(format!(
                "{} numbers fewer than the array's shape holds",
                self.missing
            )));
        }
        self.out.flush()
    }
}
