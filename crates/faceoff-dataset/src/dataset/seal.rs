//! The seal of an archive of the old layout 2: a BLAKE3 hash of all earlier bytes, at the end of the file in the zip comment. Archives of
//! later layouts have no seal.

use super::layout::Layout;
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
};

/// Hexadecimal digits of a BLAKE3 hash.
const HASH_DIGITS: u64 = 64;

/// State of an archive's seal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seal {
    /// The bytes match the seal.
    Intact,
    /// The bytes do not match the seal.
    Broken,
    /// The file does not end with a seal.
    Absent,
}

/// Reads the whole file and compares it with its seal.
pub(super) fn check(mut file: &File) -> io::Result<Seal> {
    let label = format!("{} blake3 ", Layout::Two.schema());
    let length = file.metadata()?.len();
    let Some(start) = length.checked_sub(HASH_DIGITS + label.len() as u64) else {
        return Ok(Seal::Absent);
    };
    file.seek(SeekFrom::Start(start))?;
    let mut end = Vec::new();
    file.read_to_end(&mut end)?;
    let Some(sealed) = end.strip_prefix(label.as_bytes()) else {
        return Ok(Seal::Absent);
    };
    let found = hash(file, length - HASH_DIGITS)?;
    Ok(if sealed == found.as_bytes() {
        Seal::Intact
    } else {
        Seal::Broken
    })
}

/// Hash of the file's first `covered_bytes`.
fn hash(mut file: &File, covered_bytes: u64) -> io::Result<String> {
    file.seek(SeekFrom::Start(0))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file.take(covered_bytes))?;
    Ok(hasher.finalize().to_hex().to_string())
}
