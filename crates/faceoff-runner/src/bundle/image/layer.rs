use super::{
    archive::Archive,
    digest::{Digest, Hashed},
    documents::LayerPart,
    root::Root,
};
use crate::bundle::{
    budget::{Budget, Members, Metered, Watched},
    error::BundleError,
    tar_archive,
};
use faceoff_types::ArchiveFormat;
use std::io::{self, BufRead, BufReader, Read};

/// Applies one layer to the root: a tar, plain or compressed by gzip or Zstandard, told by its first bytes. Its
/// uncompressed bytes must have the digest that the image states of them.
pub(super) fn apply<'a>(
    archive: &Archive<'a>,
    part: &LayerPart,
    root: &mut Root<'a>,
    budget: &'a Budget<'a>,
) -> Result<(), BundleError> {
    let file = archive.open(&part.name)?;
    let mut packed: BufReader<Watched<'a, std::fs::File>> =
        BufReader::with_capacity(64 << 10, file);
    let head = packed.fill_buf().map_err(BundleError::reading(""))?;
    match ArchiveFormat::detect(head) {
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
        Some(ArchiveFormat::Zip) => Err(BundleError::Invalid(
            "it is a .zip: expected a tar, plain or compressed by gzip or zstd".to_owned(),
        )),
        // One that holds nothing has no header to be told by.
        Some(ArchiveFormat::Tar) | None => apply_tar(packed, &part.diff_id, root, budget),
    }
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
