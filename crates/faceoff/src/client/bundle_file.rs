//! A bundle as one file: an archive as it is, or a folder packed into a temporary one.

use anyhow::{Context, ensure};
use flate2::{Compression, write::GzEncoder};
use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// The archive to upload; a packed folder's file goes when this is dropped.
#[derive(Debug)]
pub(super) struct BundleFile {
    place: Place,
    name: String,
    bytes: u64,
}

#[derive(Debug)]
enum Place {
    Given(PathBuf),
    Packed(NamedTempFile),
}

impl BundleFile {
    /// # Errors
    /// If the bundle cannot be read, or is a folder without `agent.toml`.
    pub(super) fn open(bundle: &Path) -> anyhow::Result<Self> {
        let absolute = bundle
            .canonicalize()
            .with_context(|| format!("the bundle {} cannot be found", bundle.display()))?;
        let name = absolute
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let (place, name) = if absolute.is_dir() {
            ensure!(
                absolute.join("agent.toml").is_file(),
                "{} has no agent.toml; a bundle's folder holds one, see docs",
                bundle.display()
            );
            let packed = pack(&absolute)
                .with_context(|| format!("packing the folder {}", bundle.display()))?;
            (Place::Packed(packed), format!("{name}.tar.gz"))
        } else {
            (Place::Given(absolute), name)
        };
        let path = match &place {
            Place::Given(path) => path.as_path(),
            Place::Packed(file) => file.path(),
        };
        let bytes = path
            .metadata()
            .with_context(|| format!("reading {}", path.display()))?
            .len();
        Ok(Self { place, name, bytes })
    }

    pub(super) fn path(&self) -> &Path {
        match &self.place {
            Place::Given(path) => path,
            Place::Packed(file) => file.path(),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) const fn bytes(&self) -> u64 {
        self.bytes
    }
}

fn pack(folder: &Path) -> std::io::Result<NamedTempFile> {
    let file = NamedTempFile::new()?;
    let gzip = GzEncoder::new(BufWriter::new(file.reopen()?), Compression::default());
    let mut archive = tar::Builder::new(gzip);
    // A link is packed as a link: following it could pick up files from outside of the folder.
    archive.follow_symlinks(false);
    archive.append_dir_all(".", folder)?;
    let writer: BufWriter<File> = archive.into_inner()?.finish()?;
    writer
        .into_inner()
        .map_err(std::io::IntoInnerError::into_error)?;
    Ok(file)
}
