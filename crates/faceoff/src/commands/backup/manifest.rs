//! Manifest of a backup, `backup.json`: where the backup comes from, and the length and hash of each of its files.

use anyhow::{Context, ensure};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::{
    fmt,
    path::{Component, Path},
};

/// File name of the manifest in a backup.
pub const MANIFEST: &str = "backup.json";
/// File name of the database, in a backup and in a data folder.
pub const DATABASE: &str = "faceoff.sqlite3";
/// Name of the folder of artifacts (files that the database refers to), in a backup and in a data folder.
pub const ARTIFACTS: &str = "artifacts";
/// Version of the manifest's format.
pub const FORMAT: u32 = 1;

/// Origin and files of a backup.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    pub format: u32,
    /// Version of Faceoff that made the backup.
    pub program: String,
    /// Newest migration of the database.
    pub schema: i64,
    pub season: String,
    /// Start time of the backup.
    pub made_at: Timestamp,
    /// Files that the database refers to and that the data folder lacked.
    #[serde(default)]
    pub missing: Vec<MissingFile>,
    pub files: Vec<BackupFile>,
}

/// A file of a backup.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BackupFile {
    /// Relative to the backup's folder.
    pub path: String,
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// A file that the database refers to and that the data folder lacked.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MissingFile {
    /// The file did not exist.
    Gone {
        /// Relative to the data folder.
        path: String,
    },
    /// The file had another hash.
    Changed {
        /// Relative to the data folder.
        path: String,
        /// BLAKE3 according to the database.
        expected: String,
        /// BLAKE3 of the file in the data folder.
        found: String,
    },
}

impl fmt::Display for MissingFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gone { path } => write!(f, "missing: {path}"),
            Self::Changed {
                path,
                expected,
                found,
            } => write!(f, "damaged: {path} has BLAKE3 {found}, expected {expected}"),
        }
    }
}

impl Manifest {
    /// Summary of the backup in `folder`, as `--json` prints it.
    pub fn summary(&self, folder: &Path) -> Value {
        json!({
            "folder": folder,
            "season": self.season,
            "made_at": self.made_at,
            "program": self.program,
            "schema": self.schema,
            "files": self.files.len(),
            "bytes": self.total_bytes(),
            "missing": self.missing,
        })
    }

    /// Parses a manifest and checks that its paths do not leave the backup's folder.
    ///
    /// # Errors
    /// If it is no manifest, or one of a later version.
    pub fn parse(text: &[u8]) -> anyhow::Result<Self> {
        #[derive(Deserialize)]
        struct Head {
            format: u32,
        }
        let head: Head = serde_json::from_slice(text).context("not a manifest of a backup")?;
        ensure!(
            head.format == FORMAT,
            "expected a manifest of format {FORMAT}, got {}: the backup was made by a later version of Faceoff; use that version",
            head.format
        );
        let manifest: Self = serde_json::from_slice(text).context("not a manifest of a backup")?;
        for file in &manifest.files {
            let mut parts = Path::new(&file.path).components();
            let is_inside =
                !file.path.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)));
            ensure!(
                is_inside,
                "expected paths below the backup's folder, got {:?}",
                file.path
            );
        }
        ensure!(
            manifest.files.iter().any(|file| file.path == DATABASE),
            "expected {DATABASE} among its files"
        );
        Ok(manifest)
    }

    #[must_use]
    pub fn total_bytes(&self) -> u64 {
        self.files
            .iter()
            .fold(0, |sum, file| sum.saturating_add(file.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(format: u32, path: &str) -> String {
        format!(
            r#"{{"format":{format},"program":"1.0.0","schema":40,"season":"S","made_at":"2026-01-01T00:00:00Z","files":[
               {{"path":"faceoff.sqlite3","bytes":1,"blake3":"00"}},{{"path":"{path}","bytes":2,"blake3":"00"}}]}}"#
        )
    }

    #[test]
    fn manifest_with_a_path_outside_the_folder_is_refused() {
        let read = |format, path| Manifest::parse(manifest(format, path).as_bytes());
        assert_eq!(read(1, "artifacts/a").unwrap().total_bytes(), 3);
        for path in ["../a", "/a", "", "artifacts/../../a", "./a"] {
            assert!(read(1, path).is_err(), "{path:?}");
        }
        let later = read(2, "a").unwrap_err().to_string();
        assert!(later.contains("a later version"), "{later}");
        assert!(Manifest::parse(b"{}").is_err());
    }
}
