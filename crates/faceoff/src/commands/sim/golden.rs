//! `faceoff sim golden`: prints the golden hashes, which show whether this build reproduces the ruleset bit by bit.

use anyhow::{Context as _, Result};
use faceoff_sim::golden;
use std::io::Write as _;

/// Runs the golden episodes and games and prints name and hash of each.
pub fn run() -> Result<()> {
    let mut out = std::io::stdout().lock();
    for golden in golden::all() {
        writeln!(out, "{golden}").context("standard output")?;
    }
    Ok(())
}
