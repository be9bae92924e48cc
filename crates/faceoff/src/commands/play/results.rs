//! The file `results.json` of `faceoff play`.

use anyhow::Context;
use serde::Serialize;
use std::{
    fs,
    io::ErrorKind,
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
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(error).with_context(|| format!("removing {}", path.display()))
            }
            _ => Ok(Self { path }),
        }
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
