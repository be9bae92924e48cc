//! A *bundle*: an agent's program with its manifest `agent.toml`, as a team submits it. It is an archive, whose bytes
//! are not trusted, a container image, or a developer's folder, which is opened in place.

mod budget;
mod entry;
mod error;
mod image;
mod links;
mod node;
mod plan;
mod sink;
mod tar_archive;
mod tree;
mod zip_archive;

pub use error::BundleError;
pub use faceoff_types::BundleLimits;
pub use image::Image;

use budget::{Budget, CancellableReader, MultiStreamReader};
use faceoff_types::{ArchiveFormat, Competition, IMAGE_RUNTIME};
use faceoff_wire::{MANIFEST_MAX_BYTES, Manifest};
use fs_err::File;
use std::{
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    time::Instant,
};
use tree::Tree;

/// Name of the manifest: a folder that contains it is a bundle.
const MANIFEST_NAME: &str = "agent.toml";

/// An unpacked bundle.
#[derive(Debug, Clone)]
pub struct Bundle {
    /// The folder that contains `agent.toml`.
    pub dir: PathBuf,
    /// The content of `agent.toml`.
    pub manifest: Manifest,
    /// Set if the bundle is a container image; then `dir` is its `/agent`. `None` for a developer's folder.
    pub image: Option<Image>,
}

/// Unpacks an archive into the folder `target_dir`, which is created and must be empty.
///
/// The first bytes determine the format: `.tar.gz`, `.tar.zst` or `.zip`. A tar, plain or compressed, without
/// `agent.toml` may be a container image, as written by `docker save` or in an OCI layout. Its layers are
/// then merged into a root folder inside `target_dir`.
///
/// Files get mode 0644, or 0755 if the archive has an executable bit. Symbolic links stay links if they lead to a path
/// inside the bundle.
///
/// Limits apply while bytes stream, so that a decompression bomb is stopped at the limit, whatever its headers claim.
/// They count everything that an archive consists of: headers, long names, padding, directories and successive streams
/// as well as the files. For an image they apply to its layers as packed and, separately, to the content of the
/// layers. Layers take at most twice [`BundleLimits::unpacked_bytes`] of the disk. `cancelled` is called for every
/// piece that is read; if it returns `true`, the unpacking stops.
///
/// The directory of a `.zip` is checked before anything is written: numbers, names, kinds and stated sizes. Folders are
/// created when something is put into them, or at the end. After an error `target_dir` contains a part of the archive, which
/// the caller removes.
///
/// # Errors
/// [`BundleError::Invalid`] with the entry's name for links that leave the bundle, absolute or
/// `..` paths, devices, set-id bits, duplicate names, a damaged archive, an exceeded limit, or a missing or
/// wrong `agent.toml`. Also for an image that is incomplete, is for another platform, or differs from its digests.
/// [`BundleError::Io`] if reading or writing the disk fails, or takes longer than [`BundleLimits::unpack_s`].
/// [`BundleError::Cancelled`] if `cancelled` returned `true`.
pub fn unpack(
    archive: &Path,
    target_dir: &Path,
    limits: &BundleLimits,
    cancelled: &dyn Fn() -> bool,
) -> Result<Bundle, BundleError> {
    let now = Instant::now;
    let budget = Budget::new(limits, &now, cancelled);
    budget.prefer_own_failure(unpack_within(archive, target_dir, &budget))
}

fn unpack_within<'a>(
    archive: &Path,
    target_dir: &Path,
    budget: &'a Budget<'a>,
) -> Result<Bundle, BundleError> {
    let limits = budget.limits();
    let mut file = File::open(archive)?;
    let packed_bytes = file.metadata()?.len();
    if packed_bytes > limits.packed_bytes {
        return Err(BundleError::Invalid(format!(
            "the archive has {packed_bytes} bytes; at most {} are allowed",
            limits.packed_bytes
        )));
    }
    let mut head = Vec::with_capacity(ArchiveFormat::DETECTION_BYTES);
    (&mut file)
        .take(ArchiveFormat::DETECTION_BYTES as u64)
        .read_to_end(&mut head)?;
    file.seek(SeekFrom::Start(0))?;

    let mut tree = Tree::new(target_dir, budget)?;
    if head.starts_with(&[0xff, 0xfe]) {
        return Err(BundleError::Invalid(
            "the bundle is text in UTF-16, as PowerShell's `>` writes it: have the program write the file itself \
             (`docker save -o ours.tar ours:latest`)"
                .to_owned(),
        ));
    }
    let format = read_archive(
        &mut tree,
        file,
        packed_bytes,
        ArchiveFormat::detect(&head),
        budget,
    );
    let format = budget
        .prefer_own_failure(format)
        .map_err(|error| tree.explain_refusal(error))?;
    match (tree.bundle_root(MANIFEST_NAME), format) {
        (Some(_), ArchiveFormat::Tar) => Err(BundleError::Invalid(
            "a plain .tar is accepted of a container image only: compress the bundle to .tar.gz"
                .to_owned(),
        )),
        (Some(root), _) => {
            tree.finish(&root)?;
            open_dir(&target_dir.join(root))
        }
        (None, ArchiveFormat::Zip) => Err(tree.explain_refusal(no_manifest())),
        (None, _) => {
            let refusal = tree.explain_refusal(no_manifest());
            let (files, nodes) = tree.into_parts();
            let archive = image::Archive::new(files, nodes, budget);
            if !archive.is_image() {
                return Err(refusal);
            }
            let (image, agent) = image::unpack(archive, MANIFEST_NAME, budget)?;
            open_image(&agent, image)
        }
    }
}

/// Reads the archive `file`, which has `packed_bytes`, into `tree`.
fn read_archive<'a>(
    tree: &mut Tree<'a>,
    file: File,
    packed_bytes: u64,
    format: Option<ArchiveFormat>,
    budget: &'a Budget<'a>,
) -> Result<ArchiveFormat, BundleError> {
    const BUFFER_BYTES: usize = 64 << 10;
    let cancellable = |file: File| {
        BufReader::with_capacity(
            BUFFER_BYTES,
            CancellableReader::new(file.into_file(), budget),
        )
    };
    let format = format.ok_or_else(|| {
        BundleError::Invalid(
            "the bundle is no archive that is accepted: expected .tar.gz, .tar.zst or .zip, or the .tar of a \
             container image"
                .to_owned(),
        )
    })?;
    match format {
        ArchiveFormat::TarGz => {
            let streams: MultiStreamReader<'_, _, flate2::bufread::GzDecoder<_>> =
                MultiStreamReader::new(cancellable(file), budget)
                    .map_err(BundleError::from_archive_read_error)?;
            tar_archive::unpack(streams, tree, budget)?;
        }
        ArchiveFormat::TarZst => {
            let streams: MultiStreamReader<'_, _, zstd::Decoder<'static, _>> =
                MultiStreamReader::new(cancellable(file), budget)
                    .map_err(BundleError::from_archive_read_error)?;
            tar_archive::unpack(streams, tree, budget)?;
        }
        ArchiveFormat::Zip => {
            let file = BufReader::with_capacity(BUFFER_BYTES, file.into_file());
            zip_archive::unpack(file, packed_bytes, tree, budget)?;
        }
        ArchiveFormat::Tar => tar_archive::unpack(cancellable(file), tree, budget)?,
    }
    Ok(format)
}

/// Checks that agents of a competition may have the bundle's interpolation.
///
/// # Errors
/// [`BundleError::Invalid`] with the interpolations that there are.
pub fn check_interpolation(bundle: &Bundle, competition: &Competition) -> Result<(), BundleError> {
    let checked = bundle.manifest.check_interpolation(&competition.actions);
    checked.map_err(|error| BundleError::Invalid(error.to_string()))
}

/// Opens a developer's own folder in place, or unpacks an archive into a new folder `bundle` of
/// `scratch`.
///
/// # Errors
/// As [`unpack`].
pub fn open(path: &Path, scratch: &Path, limits: &BundleLimits) -> Result<Bundle, BundleError> {
    let metadata = fs_err::metadata(path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            BundleError::Invalid(format!("there is no bundle at {}", path.display()))
        }
        _ => error.into(),
    })?;
    if metadata.is_dir() {
        open_dir(path)
    } else {
        unpack(path, &scratch.join("bundle"), limits, &|| false)
    }
}

/// Opens a folder of files, which has no runtime of its own.
fn open_dir(path: &Path) -> Result<Bundle, BundleError> {
    let bundle = read_manifest(path)?;
    if bundle.manifest.runtime == IMAGE_RUNTIME {
        return Err(BundleError::Invalid(format!(
            "{MANIFEST_NAME}: runtime is {IMAGE_RUNTIME:?}, and the bundle is no container image: build one and send \
             what `docker save` writes, or name a runtime that the server offers"
        )));
    }
    Ok(bundle)
}

/// Opens the folder of an agent in its image.
fn open_image(agent: &Path, image: Image) -> Result<Bundle, BundleError> {
    let bundle = read_manifest(agent)?;
    if bundle.manifest.runtime != IMAGE_RUNTIME {
        return Err(BundleError::Invalid(format!(
            "{MANIFEST_NAME}: runtime is {:?}, and the bundle is a container image, which brings its own: expected \
             {IMAGE_RUNTIME:?}",
            bundle.manifest.runtime
        )));
    }
    Ok(Bundle {
        image: Some(image),
        ..bundle
    })
}

fn read_manifest(dir: &Path) -> Result<Bundle, BundleError> {
    let dir = fs_err::canonicalize(dir)?;
    let manifest_path = dir.join(MANIFEST_NAME);
    let agent_fault = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => no_manifest(),
        io::ErrorKind::PermissionDenied => {
            BundleError::Invalid(format!("{MANIFEST_NAME} cannot be read: permission denied"))
        }
        _ => error.into(),
    };
    // Check the kind before opening: opening a named pipe blocks until a writer opens it.
    let kind = fs_err::symlink_metadata(&manifest_path)
        .map_err(agent_fault)?
        .file_type();
    if !kind.is_file() {
        let kind = if kind.is_dir() {
            "a folder"
        } else if kind.is_symlink() {
            "a link"
        } else {
            "a device, pipe or socket"
        };
        return Err(BundleError::Invalid(format!(
            "{MANIFEST_NAME} is {kind}: expected a file"
        )));
    }
    let mut bytes = Vec::new();
    File::open(&manifest_path)
        .map_err(agent_fault)?
        .take(MANIFEST_MAX_BYTES + 1)
        .read_to_end(&mut bytes)?;
    let text = String::from_utf8(bytes)
        .map_err(|_| BundleError::Invalid(format!("{MANIFEST_NAME}: not UTF-8")))?;
    let manifest =
        Manifest::parse(&text).map_err(|error| BundleError::Invalid(error.to_string()))?;
    Ok(Bundle {
        dir,
        manifest,
        image: None,
    })
}

fn no_manifest() -> BundleError {
    BundleError::Invalid(format!(
        "there is no {MANIFEST_NAME}: expected at the bundle's root or in its single top folder"
    ))
}
