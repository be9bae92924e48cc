//! A team's bundle: an archive is unpacked without trusting a byte of it, a developer's folder is
//! opened as it is.

pub use faceoff_types::BundleLimits;
use faceoff_wire::{MANIFEST_MAX_BYTES, Manifest};
use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

mod folder;
mod links;
mod tar_archive;
mod tree;
mod zip_archive;

use tree::Tree;

/// Name of the file that makes a folder a bundle.
const MANIFEST_NAME: &str = "agent.toml";

/// Why a bundle cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BundleError {
    /// The team's: the archive or its `agent.toml` is not as the protocol wants it. The text names
    /// the entry and is shown to the team.
    #[error("{0}")]
    Invalid(String),
    /// Ours: the disk did not do what it should.
    #[error("{what}: {source}")]
    Io {
        /// What was attempted.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
}

impl BundleError {
    fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::Io { what, source }
    }

    /// Reading an archive fails either because the disk does, and then the error carries the
    /// system's number, or because the bytes make no sense.
    fn reading(entry: &str) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| match source.raw_os_error() {
            Some(_) => Self::Io {
                what: "reading the archive".to_owned(),
                source,
            },
            None if entry.is_empty() => Self::Invalid(format!("the archive is damaged: {source}")),
            None => Self::Invalid(format!("the archive is damaged at {entry:?}: {source}")),
        }
    }
}

/// An unpacked bundle.
#[derive(Debug, Clone)]
pub struct Bundle {
    /// The folder that holds `agent.toml`.
    pub dir: PathBuf,
    /// What `agent.toml` says.
    pub manifest: Manifest,
}

/// Unpacks a `.tar.gz`, `.tar.zst` or `.zip`, told apart by its first bytes, into the folder
/// `into`, which is created and must be empty.
///
/// Files become 0644, or 0755 where the archive has an executable bit; symbolic links stay links
/// if they lead to a place inside the bundle. Limits hold while bytes stream, so that a
/// decompression bomb is stopped at the limit whatever its headers claim. After an error `into`
/// holds a part of the archive; the caller removes it.
///
/// # Errors
/// [`BundleError::Invalid`] with the entry's name for links that leave the bundle, absolute or
/// `..` paths, devices, set-id bits, duplicate names, a broken archive, a limit met, a missing or
/// wrong `agent.toml`; [`BundleError::Io`] where reading or writing the disk fails.
pub fn unpack(archive: &Path, into: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> {
    let mut file = File::open(archive).map_err(BundleError::io("opening the archive"))?;
    let packed = file
        .metadata()
        .map_err(BundleError::io("reading the archive's size"))?
        .len();
    if packed > limits.packed_bytes {
        return Err(BundleError::Invalid(format!(
            "the archive has {packed} bytes; at most {} are allowed",
            limits.packed_bytes
        )));
    }
    let mut magic = Vec::with_capacity(4);
    (&mut file)
        .take(4)
        .read_to_end(&mut magic)
        .map_err(BundleError::io("reading the archive"))?;
    file.seek(SeekFrom::Start(0))
        .map_err(BundleError::io("reading the archive"))?;

    let mut tree = Tree::new(into, limits)?;
    let file = BufReader::with_capacity(64 << 10, file);
    match magic.as_slice() {
        [0x1f, 0x8b, ..] => {
            tar_archive::unpack(flate2::bufread::MultiGzDecoder::new(file), &mut tree)?;
        }
        [0x28, 0xb5, 0x2f, 0xfd] => {
            let decoder = zstd::Decoder::with_buffer(file).map_err(BundleError::reading(""))?;
            tar_archive::unpack(decoder, &mut tree)?;
        }
        [b'P', b'K', 3 | 5, 4 | 6] => zip_archive::unpack(file, &mut tree)?,
        _ => {
            return Err(BundleError::Invalid(
                "the bundle is no archive that is accepted: expected .tar.gz, .tar.zst or .zip"
                    .to_owned(),
            ));
        }
    }
    let root = tree.bundle_root(MANIFEST_NAME)?;
    tree.finish(&root)?;
    open_dir(&into.join(root))
}

/// Opens a developer's own folder in place, or unpacks an archive into a new folder `bundle` of
/// `scratch`.
///
/// # Errors
/// As [`unpack`].
pub fn open(path: &Path, scratch: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> {
    let metadata = path.metadata().map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => {
            BundleError::Invalid(format!("there is no bundle at {}", path.display()))
        }
        _ => BundleError::Io {
            what: format!("opening {}", path.display()),
            source,
        },
    })?;
    if metadata.is_dir() {
        open_dir(path)
    } else {
        unpack(path, &scratch.join("bundle"), limits)
    }
}

/// Copies a developer's own folder into the folder `into`, which is created and must be empty, under
/// the rules and limits of an archive: what is refused here would be refused by the server.
///
/// # Errors
/// As [`unpack`].
pub fn copy(folder: &Path, into: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> {
    let mut tree = Tree::new(into, limits)?;
    folder::copy(folder, &mut tree)?;
    let root = tree.bundle_root(MANIFEST_NAME)?;
    tree.finish(&root)?;
    open_dir(&into.join(root))
}

fn open_dir(path: &Path) -> Result<Bundle, BundleError> {
    let dir = path
        .canonicalize()
        .map_err(BundleError::io(format!("opening {}", path.display())))?;
    let file = match File::open(dir.join(MANIFEST_NAME)) {
        Ok(file) => file,
        Err(source) if source.kind() == io::ErrorKind::NotFound => {
            return Err(no_manifest());
        }
        Err(source) => {
            return Err(BundleError::Io {
                what: format!("opening {MANIFEST_NAME}"),
                source,
            });
        }
    };
    let mut bytes = Vec::new();
    file.take(MANIFEST_MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(BundleError::io(format!("reading {MANIFEST_NAME}")))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| BundleError::Invalid(format!("{MANIFEST_NAME}: not UTF-8")))?;
    let manifest =
        Manifest::parse(&text).map_err(|error| BundleError::Invalid(error.to_string()))?;
    Ok(Bundle { dir, manifest })
}

fn no_manifest() -> BundleError {
    BundleError::Invalid(format!(
        "there is no {MANIFEST_NAME}: expected at the bundle's root or in its single top folder"
    ))
}
