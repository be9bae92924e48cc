//! A bundle as one file: an archive as it is, or a folder packed into a temporary one.

use super::selection::Selection;
use anyhow::Context;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The archive to upload; a packed folder's file goes when this is dropped.
#[derive(Debug)]
pub struct BundleFile {
    place: Place,
    name: String,
    bytes: u64,
}

#[derive(Debug)]
enum Place {
    Given(PathBuf),
    Packed(NamedTempFile, Selection),
}

impl BundleFile {
    /// The file of an archive, or one that a folder is packed into.
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
        let (place, name) = if absolute.is_dir() {
            let selection = Selection::of(&absolute)?;
            let packed = NamedTempFile::new().context("making a temporary file")?;
            let file = packed.reopen().context("opening a temporary file")?;
            selection.pack(file)?;
            (Place::Packed(packed, selection), format!("{name}.tar.gz"))
        } else {
            (Place::Given(absolute), name)
        };
        let path = match &place {
            Place::Given(path) => path.as_path(),
            Place::Packed(file, _) => file.path(),
        };
        let bytes = path
            .metadata()
            .with_context(|| format!("reading {}", path.display()))?
            .len();
        Ok(Self { place, name, bytes })
    }

    /// What of a folder is in it; of an archive nobody has looked.
    pub const fn selection(&self) -> Option<&Selection> {
        match &self.place {
            Place::Given(_) => None,
            Place::Packed(_, selection) => Some(selection),
        }
    }

    pub fn path(&self) -> &Path {
        match &self.place {
            Place::Given(path) => path,
            Place::Packed(file, _) => file.path(),
        }
    }

    /// What the server is told that it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub const fn bytes(&self) -> u64 {
        self.bytes
    }
}
