//! The file that `faceoff replay` writes.

use anyhow::{Context, bail};
use std::{
    fs,
    path::{Path, PathBuf},
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Html,
    Svg,
}

impl Format {
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("html" | "htm") => Ok(Self::Html),
            Some("svg") => Ok(Self::Svg),
            _ => bail!(
                "--out: expected a file that ends in .html or .svg, got {}",
                path.display()
            ),
        }
    }
}

/// The file to write, and what is printed about it.
pub struct Output {
    pub file: PathBuf,
    pub format: Format,
    /// Print JSON.
    pub json: bool,
}

impl Output {
    pub fn write(&self, text: String) -> anyhow::Result<()> {
        fs::write(&self.file, text).with_context(|| format!("writing {}", self.file.display()))
    }
}
