//! Capabilities that a worker or server reports to its counterpart: program, version, runtimes and slots.

use anyhow::Context as _;
use faceoff_runner::{AgentEnvironment, take_inventory};
use faceoff_wire::remote::WorkerCapabilities;
use std::fs;

/// The capabilities of this program on this host.
///
/// # Errors
/// If the program's own file cannot be read.
pub fn own_capabilities(
    agent: &AgentEnvironment,
    slots: usize,
) -> anyhow::Result<WorkerCapabilities> {
    let program = std::env::current_exe().context("finding this program's file")?;
    let mut hasher = blake3::Hasher::new();
    fs::File::open(&program)
        .and_then(|file| hasher.update_reader(file).map(drop))
        .with_context(|| format!("reading {}", program.display()))?;
    Ok(WorkerCapabilities {
        program_blake3: hasher.finalize().to_string(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        runtimes: take_inventory(agent),
        slots: u32::try_from(slots).unwrap_or(u32::MAX),
        labels: Vec::new(),
    })
}
