//! Applies one *layer* of a container image, a packed tar archive, to the image's root folder.

use super::{
    archive::Archive,
    digest::{Digest, HashingReader},
    documents::LayerPart,
    root::Root,
};
use crate::bundle::{
    budget::{Budget, MeteredReader, MultiStreamReader},
    error::BundleError,
    tar_archive,
};
use faceoff_types::ArchiveFormat;
use std::io::{self, BufRead, BufReader, Read};

/// Applies one layer to the root: a tar, plain or compressed by gzip or Zstandard, detected by its first bytes. Its
/// uncompressed bytes must have the digest in the image's configuration.
pub(super) fn apply<'a>(
    archive: &mut Archive<'a>,
    layer: &LayerPart,
    root: &mut Root<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut packed_layer = BufReader::with_capacity(64 << 10, archive.open(&layer.name)?);
    let head = packed_layer
        .fill_buf()
        .map_err(BundleError::from_archive_read_error)?;
    let format = ArchiveFormat::detect(head);
    let is_compressed = matches!(format, Some(ArchiveFormat::TarGz | ArchiveFormat::TarZst));
    // An uncompressed layer has the same digest as a blob and as a layer, so it is hashed while it is applied.
    if is_compressed || Digest::from_blob_path(&layer.name).as_ref() != Some(&layer.diff_id) {
        archive.verify(&layer.name)?;
    }
    match format {
        Some(ArchiveFormat::TarGz) => {
            let streams: MultiStreamReader<'_, _, flate2::bufread::GzDecoder<_>> =
                MultiStreamReader::new(packed_layer, budget)
                    .map_err(BundleError::from_archive_read_error)?;
            apply_tar(streams, &layer.diff_id, root, budget)
        }
        Some(ArchiveFormat::TarZst) => {
            let streams: MultiStreamReader<'_, _, zstd::Decoder<'static, _>> =
                MultiStreamReader::new(packed_layer, budget)
                    .map_err(BundleError::from_archive_read_error)?;
            apply_tar(streams, &layer.diff_id, root, budget)
        }
        Some(ArchiveFormat::Zip) => Err(unsupported_format("a .zip")),
        None if head.starts_with(b"\xfd7zXZ") => Err(unsupported_format("compressed by xz")),
        None if head.starts_with(b"BZh") => Err(unsupported_format("compressed by bzip2")),
        // An empty layer has no header to detect.
        Some(ArchiveFormat::Tar) | None => apply_tar(packed_layer, &layer.diff_id, root, budget),
    }
}

fn unsupported_format(format: &str) -> BundleError {
    BundleError::Invalid(format!(
        "it is {format}: expected a tar, plain or compressed by gzip or zstd"
    ))
}

fn apply_tar<'a>(
    reader: impl Read,
    diff_id: &Digest,
    root: &mut Root<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let mut hashed = HashingReader::new(reader);
    tar_archive::unpack(&mut hashed, root, budget)?;
    // The digest covers all bytes including padding. The bytes read here are not part of files, and count as overhead.
    io::copy(
        &mut MeteredReader::new(&mut hashed, budget),
        &mut io::sink(),
    )
    .map_err(BundleError::from_archive_read_error)?;
    diff_id.check("its uncompressed content", hashed.into_hash())
}
