//! The file `results.json` of `faceoff play`.

use anyhow::Context;
use faceoff_dataset::allow_missing;
use serde::Serialize;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// `results.json` beside the recordings. The file is complete or absent.
#[derive(Debug)]
pub(super) struct Results {
    path: PathBuf,
}

impl Results {
    /// The file in a folder; removes an earlier one.
    pub(super) fn clear_in(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join("results.json");
        allow_missing(fs::remove_file(&path))
            .with_context(|| format!("removing {}", path.display()))?;
        Ok(Self { path })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file and returns its text.
    pub(super) fn write(&self, results: &impl Serialize) -> anyhow::Result<String> {
        let mut json = serde_json::to_string_pretty(results).context("the result")?;
        json.push('\n');
        let writing = || format!("writing {}", self.path.display());
        let partial = self.path.with_extension("json.partial");
        fs::write(&partial, &json).with_context(writing)?;
        fs::rename(&partial, &self.path).with_context(writing)?;
        Ok(json)
    }
}
