//! What this program tells of itself to another of its kind.

use anyhow::Context as _;
use faceoff_runner::{AgentEnvironment, inventory};
use faceoff_wire::remote::Introduction;
use std::fs;

/// What this program is, with these runtimes and slots.
///
/// # Errors
/// If it cannot read its own file.
pub fn introduction(agent: &AgentEnvironment, slots: usize) -> anyhow::Result<Introduction> {
    let program = std::env::current_exe().context("finding this program's file")?;
    let mut hasher = blake3::Hasher::new();
    fs::File::open(&program)
        .and_then(|file| hasher.update_reader(file).map(drop))
        .with_context(|| format!("reading {}", program.display()))?;
    Ok(Introduction {
        program: hasher.finalize().to_string(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        runtimes: inventory(agent),
        slots: u32::try_from(slots).unwrap_or(u32::MAX),
        labels: Vec::new(),
    })
}
