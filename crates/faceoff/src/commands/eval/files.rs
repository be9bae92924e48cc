//! The files of `faceoff eval --out`.

use anyhow::Context;
use faceoff_dataset::{ARCHIVE_FILE, allow_missing};
use std::{fs, path::Path};

pub(super) const RESULTS: &str = "results.json";
/// The agent's log, written if the agent had faults.
pub(super) const LOG: &str = "agent.log";
/// The comparison of all profiles.
pub(super) const ABLATION: &str = "ablation.json";

/// Removes the files of an earlier run, so that they are not mistaken for results of this run.
pub(super) fn remove_earlier(out: &Path) -> anyhow::Result<()> {
    for path in [RESULTS, ARCHIVE_FILE, LOG, ABLATION].map(|name| out.join(name)) {
        allow_missing(fs::remove_file(&path))
            .with_context(|| format!("removing {}", path.display()))?;
    }
    Ok(())
}

pub(super) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut json = serde_json::to_string_pretty(value).context("writing the result")?;
    json.push('\n');
    fs::write(path, json).with_context(|| format!("writing {}", path.display()))
}
