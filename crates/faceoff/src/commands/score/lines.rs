//! Output as lines of JSON.

use anyhow::Context as _;
use std::io::Write;

/// Writes a value as one line of JSON.
pub fn write_line(out: &mut impl Write, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    // The io::Error stays the source of the error, so that a closed pipe can be recognised.
    out.write_all(&line).context("standard output")
}
