use anyhow::Context as _;
use std::io::Write;

/// One JSON object, one line.
pub fn write_line(out: &mut impl Write, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    // With its io::Error as the cause: a reader that goes away is no failure of ours.
    out.write_all(&line).context("standard output")
}
