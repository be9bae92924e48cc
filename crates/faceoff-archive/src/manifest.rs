//! The manifest of an archive: its first file, which lists the path, length and hash of all others.

use crate::{error::ArchiveError, format::FORMAT};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use std::{collections::BTreeSet, fmt};

/// Name of the first file of an archive.
pub const MANIFEST_NAME: &str = "manifest.json";

/// Maximum length of a manifest in bytes, since it is held in memory.
pub(crate) const MANIFEST_MAX_BYTES: u64 = 64 << 20;
/// Maximum number of files in an archive.
const MAX_FILES: usize = 500_000;
/// Maximum length of a path. A plain tar header has space for it, wherever it is split between the two name fields.
const PATH_MAX_BYTES: usize = 155;
/// Maximum length of a part of a path, between two slashes.
const PART_MAX_BYTES: usize = 100;

/// The readers that an archive is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edition {
    /// For the public: what a visitor without a token may read.
    Public,
    /// For the organiser: everything except secrets.
    Organiser,
}

impl fmt::Display for Edition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Public => "public",
            Self::Organiser => "organiser",
        })
    }
}

/// The manifest of an archive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`] of the program that wrote it.
    pub format: u32,
    /// Name and version of that program, for example `faceoff 0.1.0`.
    pub program: String,
    /// Name of the season.
    pub season: String,
    /// Time of the data in the archive.
    pub made_at: Timestamp,
    /// The readers that it is for.
    pub edition: Edition,
    /// Descriptions of data that readers may expect but that are not included.
    pub left_out: Vec<String>,
    /// All other files, in the sequence of the archive.
    pub files: Vec<Entry>,
}

/// A file of an archive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Relative path of ASCII letters, digits and `. _ -`, with slashes between its parts.
    pub path: String,
    /// Length of the file.
    pub bytes: u64,
    /// BLAKE3 hash of its content, 64 hexadecimal digits.
    pub blake3: String,
}

impl Manifest {
    /// Total length of all files in bytes, saturating.
    #[must_use]
    pub fn total_bytes(&self) -> u64 {
        let bytes = self.files.iter().map(|file| file.bytes);
        bytes.fold(0, u64::saturating_add)
    }

    /// Parses an untrusted manifest.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, ArchiveError> {
        // A later format may have other fields, but it keeps these.
        #[derive(Deserialize)]
        struct Head {
            format: u64,
            #[serde(default)]
            program: String,
        }
        let invalid = |error: serde_json::Error| {
            ArchiveError::Refused(format!(
                "{MANIFEST_NAME} is not the manifest of a season's archive: {error}"
            ))
        };
        let Head { format, program } = serde_json::from_slice(bytes).map_err(invalid)?;
        if format > u64::from(FORMAT) {
            let program = program.chars().take(100).collect();
            return Err(ArchiveError::Newer { format, program });
        }
        let manifest: Self = serde_json::from_slice(bytes).map_err(invalid)?;
        manifest.check()?;
        Ok(manifest)
    }

    /// Checks the number of files, their paths and the format of the hashes.
    ///
    /// # Errors
    /// [`ArchiveError::Refused`].
    pub fn check(&self) -> Result<(), ArchiveError> {
        if self.files.len() > MAX_FILES {
            return Err(ArchiveError::Refused(format!(
                "{MANIFEST_NAME} names {} files; at most {MAX_FILES} are allowed",
                self.files.len()
            )));
        }
        let json = serde_json::to_vec_pretty(self).map_err(|error| {
            ArchiveError::Refused(format!("{MANIFEST_NAME} cannot be written: {error}"))
        })?;
        if json.len() as u64 > MANIFEST_MAX_BYTES {
            return Err(ArchiveError::Refused(format!(
                "{MANIFEST_NAME} has {} bytes for {} files; at most {MANIFEST_MAX_BYTES} are allowed",
                json.len(),
                self.files.len()
            )));
        }
        let mut seen = BTreeSet::new();
        for file in &self.files {
            let refuse = |reason: &str| {
                let shown: String = file.path.chars().take(200).collect();
                Err(ArchiveError::Refused(format!(
                    "{MANIFEST_NAME} names the file {shown:?}: {reason}"
                )))
            };
            if file.path == MANIFEST_NAME {
                return refuse("the manifest does not name itself");
            }
            if let Err(reason) = check_path(&file.path) {
                return refuse(reason);
            }
            if blake3::Hash::from_hex(&file.blake3).is_err() {
                return refuse("its hash is not of 64 hexadecimal digits");
            }
            if !seen.insert(file.path.as_str()) {
                return refuse("it is named twice");
            }
        }
        Ok(())
    }
}

fn check_path(path: &str) -> Result<(), &'static str> {
    if path.len() > PATH_MAX_BYTES {
        return Err("a path has at most 155 bytes");
    }
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    for part in path.split('/') {
        if part.is_empty() {
            return Err("expected a relative path without empty parts");
        }
        if matches!(part, "." | "..") {
            return Err("expected a path without “.” and “..”");
        }
        if part.len() > PART_MAX_BYTES {
            return Err("a part of a path has at most 100 bytes");
        }
        if !part.bytes().all(is_plain) {
            return Err("expected ASCII letters, digits, dots, underscores, hyphens and slashes");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_must_be_plain_and_relative() {
        let long_part = format!("{}/x", "a".repeat(PART_MAX_BYTES + 1));
        let long_path = "ab/".repeat(60) + "x";
        for valid in [
            "a",
            "results/1-qualifying/board.json",
            "artifacts/d/A_b-9.zip",
        ] {
            assert_eq!(check_path(valid), Ok(()), "{valid}");
        }
        for invalid in [
            "",
            "/etc/passwd",
            "../x",
            "a/../../x",
            "a/./b",
            "a//b",
            "a/",
            "a b",
            "a\\b",
            "a\0b",
            "ä",
            &long_part,
            &long_path,
        ] {
            assert!(check_path(invalid).is_err(), "{invalid:?}");
        }
    }
}
