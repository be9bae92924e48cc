//! A team's bundle: an archive is unpacked without trusting a byte of it, a developer's folder is
//! opened as it is.

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

use budget::{Budget, Members, Watched};
use faceoff_types::{ArchiveFormat, IMAGE_RUNTIME};
use faceoff_wire::{MANIFEST_MAX_BYTES, Manifest};
use fs_err::File;
use std::{
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    time::Instant,
};
use tree::Tree;

/// Name of the file that makes a folder a bundle.
const MANIFEST_NAME: &str = "agent.toml";

#[derive(Debug, Clone)]
pub struct Bundle {
    /// The folder that holds `agent.toml`.
    pub dir: PathBuf,
    /// What `agent.toml` says.
    pub manifest: Manifest,
    /// The container image that the bundle is; `dir` is its `/agent`. A developer's folder is none.
    pub image: Option<Image>,
}

/// Unpacks a `.tar.gz`, `.tar.zst` or `.zip`, told apart by its first bytes, into the folder
/// `into`, which is created and must be empty. A tar, plain or compressed, that has no `agent.toml` but is a
/// container image, as `docker save` or an OCI layout has it, becomes the image's root.
///
/// Files become 0644, or 0755 where the archive has an executable bit; symbolic links stay links
/// if they lead to a place inside the bundle. Limits hold while bytes stream, so that a
/// decompression bomb is stopped at the limit whatever its headers claim, and count all that an
/// archive is made of: headers, long names, padding, directories and streams one after another as well as
/// the files. Of an image they hold for its layers as they come and, once more, for what they hold; layers
/// take twice [`BundleLimits::unpacked_bytes`] of the disk at most. `cancelled` is asked for every piece.
///
/// Of a `.zip` nothing is written before its directory has been checked: numbers, names, kinds and stated
/// sizes. Of any archive a folder is made when something is put into it, or at the end. After an error `into`
/// holds a part of the archive; the caller removes it.
///
/// # Errors
/// [`BundleError::Invalid`] with the entry's name for links that leave the bundle, absolute or
/// `..` paths, devices, set-id bits, duplicate names, a broken archive, a limit met, a missing or
/// wrong `agent.toml`, an image that is none, is for another machine, or differs from its digests; [`BundleError::Io`] where reading or writing the disk fails, or takes longer
/// than [`BundleLimits::unpack_s`]; [`BundleError::Cancelled`] when `cancelled` said so.
pub fn unpack(
    archive: &Path,
    into: &Path,
    limits: &BundleLimits,
    cancelled: &dyn Fn() -> bool,
) -> Result<Bundle, BundleError> {
    let now = Instant::now;
    let budget = Budget::new(limits, &now, cancelled);
    budget.verdict(unpack_within(archive, into, &budget))
}

fn unpack_within<'a>(
    archive: &Path,
    into: &Path,
    budget: &'a Budget<'a>,
) -> Result<Bundle, BundleError> {
    let limits = budget.limits();
    let mut file = File::open(archive)?;
    let packed = file.metadata()?.len();
    if packed > limits.packed_bytes {
        return Err(BundleError::Invalid(format!(
            "the archive has {packed} bytes; at most {} are allowed",
            limits.packed_bytes
        )));
    }
    let mut head = Vec::with_capacity(ArchiveFormat::LONGEST_MAGIC);
    (&mut file)
        .take(ArchiveFormat::LONGEST_MAGIC as u64)
        .read_to_end(&mut head)?;
    file.seek(SeekFrom::Start(0))?;

    let mut tree = Tree::new(into, budget)?;
    if head.starts_with(&[0xff, 0xfe]) {
        return Err(BundleError::Invalid(
            "the bundle is text in UTF-16, as PowerShell's `>` writes it: have the program write the file itself \
             (`docker save -o ours.tar ours:latest`)"
                .to_owned(),
        ));
    }
    let read = read_into(
        &mut tree,
        file,
        packed,
        ArchiveFormat::detect(&head),
        budget,
    );
    let format = budget
        .verdict(read)
        .map_err(|error| tree.explain_refusal(error))?;
    match (tree.bundle_root(MANIFEST_NAME), format) {
        (Some(_), ArchiveFormat::Tar) => Err(BundleError::Invalid(
            "a plain .tar is accepted of a container image only: compress the bundle to .tar.gz"
                .to_owned(),
        )),
        (Some(root), _) => {
            tree.finish(&root)?;
            open_dir(&into.join(root))
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

/// Reads the archive `file` of `packed` bytes into `tree`.
fn read_into<'a>(
    tree: &mut Tree<'a>,
    file: File,
    packed: u64,
    format: Option<ArchiveFormat>,
    budget: &'a Budget<'a>,
) -> Result<ArchiveFormat, BundleError> {
    let buffered = 64 << 10;
    let watched =
        |file: File| BufReader::with_capacity(buffered, Watched::new(file.into_file(), budget));
    let format = format.ok_or_else(|| {
        BundleError::Invalid(
            "the bundle is no archive that is accepted: expected .tar.gz, .tar.zst or .zip, or the .tar of a \
             container image"
                .to_owned(),
        )
    })?;
    match format {
        ArchiveFormat::TarGz => {
            let streams: Members<'_, _, flate2::bufread::GzDecoder<_>> =
                Members::new(watched(file), budget).map_err(BundleError::reading(""))?;
            tar_archive::unpack(streams, tree, budget)?;
        }
        ArchiveFormat::TarZst => {
            let streams: Members<'_, _, zstd::Decoder<'static, _>> =
                Members::new(watched(file), budget).map_err(BundleError::reading(""))?;
            tar_archive::unpack(streams, tree, budget)?;
        }
        ArchiveFormat::Zip => {
            let file = BufReader::with_capacity(buffered, file.into_file());
            zip_archive::unpack(file, packed, tree, budget)?;
        }
        ArchiveFormat::Tar => tar_archive::unpack(watched(file), tree, budget)?,
    }
    Ok(format)
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

/// A folder of files, which brings no runtime of its own.
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

/// The folder of an agent in its image.
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

fn read_manifest(path: &Path) -> Result<Bundle, BundleError> {
    let dir = fs_err::canonicalize(path)?;
    let place = dir.join(MANIFEST_NAME);
    let teams_own = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => no_manifest(),
        io::ErrorKind::PermissionDenied => {
            BundleError::Invalid(format!("{MANIFEST_NAME} cannot be read: permission denied"))
        }
        _ => error.into(),
    };
    // Looked at before it is opened: opening a pipe waits for somebody to write.
    let kind = fs_err::symlink_metadata(&place)
        .map_err(teams_own)?
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
    File::open(&place)
        .map_err(teams_own)?
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
