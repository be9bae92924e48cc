use super::{
    archive::Archive,
    digest::{Digest, Hashed},
    documents::LayerPart,
    root::Root,
};
use crate::bundle::{
    budget::{Budget, Members, Metered},
    error::BundleError,
    tar_archive,
};
use faceoff_types::ArchiveFormat;
use std::io::{self, BufRead, BufReader, Read};

/// Applies one layer to the root: a tar, plain or compressed by gzip or Zstandard, told by its first bytes. Its
/// uncompressed bytes must have the digest that the image states of them.
pub(super) fn apply<'a>(
    archive: &mut Archive<'a>,
    part: &LayerPart,
    root: &mut Root<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut packed = BufReader::with_capacity(64 << 10, archive.open(&part.name)?);
    let head = packed.fill_buf().map_err(BundleError::reading(""))?;
    let format = ArchiveFormat::detect(head);
    let is_compressed = matches!(format, Some(ArchiveFormat::TarGz | ArchiveFormat::TarZst));
    // One that is not has the same digest twice, and is hashed as it is applied.
    if is_compressed || Digest::of_blob(&part.name).as_ref() != Some(&part.diff_id) {
        archive.verify(&part.name)?;
    }
    match format {
        Some(ArchiveFormat::TarGz) => {
            let streams: Members<'_, _, flate2::bufread::GzDecoder<_>> =
                Members::new(packed, budget).map_err(BundleError::reading(""))?;
            apply_tar(streams, &part.diff_id, root, budget)
        }
        Some(ArchiveFormat::TarZst) => {
            let streams: Members<'_, _, zstd::Decoder<'static, _>> =
                Members::new(packed, budget).map_err(BundleError::reading(""))?;
            apply_tar(streams, &part.diff_id, root, budget)
        }
        Some(ArchiveFormat::Zip) => Err(not_taken("a .zip")),
        None if head.starts_with(b"\xfd7zXZ") => Err(not_taken("compressed by xz")),
        None if head.starts_with(b"BZh") => Err(not_taken("compressed by bzip2")),
        // One that holds nothing has no header to be told by.
        Some(ArchiveFormat::Tar) | None => apply_tar(packed, &part.diff_id, root, budget),
    }
}

fn not_taken(what: &str) -> BundleError {
    BundleError::Invalid(format!(
        "it is {what}: expected a tar, plain or compressed by gzip or zstd"
    ))
}

fn apply_tar<'a>(
    reader: impl Read,
    diff_id: &Digest,
    root: &mut Root<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut hashed = Hashed::new(reader);
    tar_archive::unpack(&mut hashed, root, budget)?;
    // The digest is of all, padding included; what is read here is beside the files, and counted as such.
    io::copy(&mut Metered::new(&mut hashed, budget), &mut io::sink())
        .map_err(BundleError::reading(""))?;
    diff_id.check("its uncompressed content", hashed.into_hash())
}
