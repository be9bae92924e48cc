//! In layout 2 the archive's comment holds the BLAKE3 hash of all bytes before that hash.

use super::layout::Layout;
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
};

/// Hexadecimal digits of a hash.
const DIGITS: u64 = 64;

/// State of an archive's seal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seal {
    /// The bytes match the seal.
    Intact,
    Broken,
    /// The file does not end with a seal.
    Absent,
}

/// Reads the whole file and compares it with its seal.
pub(super) fn check(mut file: &File) -> io::Result<Seal> {
    let label = format!("{} blake3 ", Layout::Two.schema());
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
