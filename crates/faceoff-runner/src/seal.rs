//! The archive's comment holds the BLAKE3 hash of all bytes before that hash. The manifest covers what
//! is in the files; the seal covers what is between them, where the checksums of a zip do not reach.

use crate::PlatformFault;
use faceoff_wire::dataset::DATASET_SCHEMA;
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
};

/// Hexadecimal digits of a hash.
const DIGITS: u64 = 64;

/// What precedes the hash.
fn label() -> String {
    format!("{DATASET_SCHEMA} blake3 ")
}

/// The comment of an archive that is not sealed yet.
pub(crate) fn blank() -> String {
    format!("{}{}", label(), "0".repeat(DIGITS as usize))
}

/// Seals the finished archive.
pub(crate) fn put(path: &Path) -> Result<(), PlatformFault> {
    let sealing = || PlatformFault::io(format!("sealing {}", path.display()));
    let mut file = File::options()
        .read(true)
        .write(true)
        .open(path)
        .map_err(sealing())?;
    let covered = file.metadata().map_err(sealing())?.len() - DIGITS;
    let hash = hash(&file, covered).map_err(sealing())?;
    file.seek(SeekFrom::Start(covered))
        .and_then(|_| file.write_all(hash.as_bytes()))
        .and_then(|()| file.sync_all())
        .map_err(sealing())
}

/// What the end of an archive says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seal {
    /// The bytes are those that were sealed.
    Intact,
    /// They are not.
    Broken,
    /// The file does not end with a seal.
    Absent,
}

/// Reads the whole file and compares it with its seal.
pub(crate) fn check(mut file: &File) -> io::Result<Seal> {
    let label = label();
    let length = file.metadata()?.len();
    let Some(start) = length.checked_sub(DIGITS + label.len() as u64) else {
        return Ok(Seal::Absent);
    };
    file.seek(SeekFrom::Start(start))?;
    let mut end = Vec::new();
    file.read_to_end(&mut end)?;
    let Some(sealed) = end.strip_prefix(label.as_bytes()) else {
        return Ok(Seal::Absent);
    };
    let found = hash(file, length - DIGITS)?;
    Ok(if sealed == found.as_bytes() {
        Seal::Intact
    } else {
        Seal::Broken
    })
}

fn hash(mut file: &File, covered: u64) -> io::Result<String> {
    file.seek(SeekFrom::Start(0))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file.take(covered))?;
    Ok(hasher.finalize().to_hex().to_string())
}
