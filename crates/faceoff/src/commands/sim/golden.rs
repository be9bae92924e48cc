//! `faceoff sim golden`: whether this program has the ruleset's bits.

use anyhow::{Context as _, Result};
use faceoff_sim::golden;
use std::io::Write as _;

/// Plays the golden episodes and games and prints a line for each: name and hash.
pub fn run() -> Result<()> {
    let mut out = std::io::stdout().lock();
    for golden in golden::all() {
        writeln!(out, "{golden}").context("standard output")?;
    }
    Ok(())
}
