//! A bundle as one file: an existing archive, or a folder packed into a temporary file.

use super::selection::Selection;
use anyhow::Context;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The archive to upload. The temporary file of a packed folder is deleted when this is dropped.
#[derive(Debug)]
pub struct BundleFile {
    source: Source,
    name: String,
    bytes: u64,
}

#[derive(Debug)]
enum Source {
    Archive(PathBuf),
    Packed(NamedTempFile, Selection),
}

impl BundleFile {
    /// Opens an archive, or packs a folder.
    ///
    /// # Errors
    /// If the bundle cannot be read, or is a folder without `agent.toml`.
    pub fn open(bundle: &Path) -> anyhow::Result<Self> {
        let absolute = bundle
            .canonicalize()
            .with_context(|| format!("the bundle {} cannot be found", bundle.display()))?;
        let name = absolute
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let (source, name) = if absolute.is_dir() {
            let selection = Selection::read(&absolute)?;
            let packed = NamedTempFile::new().context("creating a temporary file")?;
            let file = packed.reopen().context("opening a temporary file")?;
            selection.pack(file)?;
            (Source::Packed(packed, selection), format!("{name}.tar.gz"))
        } else {
            (Source::Archive(absolute), name)
        };
        let path = match &source {
            Source::Archive(path) => path.as_path(),
            Source::Packed(file, _) => file.path(),
        };
        let bytes = path
            .metadata()
            .with_context(|| format!("reading {}", path.display()))?
            .len();
        Ok(Self {
            source,
            name,
            bytes,
        })
    }

    /// The packed files of a folder; `None` for an archive, which is not opened.
    pub const fn selection(&self) -> Option<&Selection> {
        match &self.source {
            Source::Archive(_) => None,
            Source::Packed(_, selection) => Some(selection),
        }
    }

    pub fn path(&self) -> &Path {
        match &self.source {
            Source::Archive(path) => path,
            Source::Packed(file, _) => file.path(),
        }
    }

    /// The file name for the server.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub const fn bytes(&self) -> u64 {
        self.bytes
    }
}
