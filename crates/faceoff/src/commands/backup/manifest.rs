//! What a backup says of itself.

use anyhow::{Context, ensure};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::{
    fmt,
    path::{Component, Path},
};

/// The manifest's name in the backup's folder.
pub const MANIFEST: &str = "backup.json";
/// The database's, there and in a data folder.
pub const DATABASE: &str = "faceoff.sqlite3";
/// The artifacts' folder, in both.
pub const ARTIFACTS: &str = "artifacts";
/// Of the manifest; a later one may mean other things.
pub const FORMAT: u32 = 1;

/// The list of what is in a backup.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    pub format: u32,
    /// Version that made it.
    pub program: String,
    /// Newest migration of the database.
    pub schema: i64,
    pub season: String,
    /// When it was begun.
    pub made_at: Timestamp,
    /// What the database names and the data folder did not have.
    #[serde(default)]
    pub missing: Vec<Missing>,
    pub files: Vec<Part>,
}

/// A file of a backup.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// From the backup's folder.
    pub path: String,
    pub bytes: u64,
    /// BLAKE3, 64 hexadecimal digits.
    pub blake3: String,
}

/// What the database names and the data folder did not have as it was stored.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Missing {
    /// It was not there.
    Gone {
        /// From the data folder.
        path: String,
    },
    /// It was another file.
    Changed {
        /// From the data folder.
        path: String,
        /// BLAKE3 by the database.
        expected: String,
        /// BLAKE3 of what was there.
        found: String,
    },
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gone { path } => write!(f, "missing: {path}"),
            Self::Changed {
                path,
                expected,
                found,
            } => write!(
                f,
                "damaged: {path} has BLAKE3 {found}, where {expected} was stored"
            ),
        }
    }
}

impl Manifest {
    /// In short, of what lies in `folder`: as `--json` prints it.
    pub fn told(&self, folder: &Path) -> Value {
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

    /// Reads one, and makes sure that its paths stay where they belong.
    ///
    /// # Errors
    /// If it is none, or of a later version.
    pub fn parse(text: &[u8]) -> anyhow::Result<Self> {
        #[derive(Deserialize)]
        struct Head {
            format: u32,
        }
        let head: Head = serde_json::from_slice(text).context("no manifest of a backup")?;
        ensure!(
            head.format == FORMAT,
            "expected a manifest of format {FORMAT}, got {}: a later version of Faceoff made the backup; use that",
            head.format
        );
        let manifest: Self = serde_json::from_slice(text).context("no manifest of a backup")?;
        for file in &manifest.files {
            let mut parts = Path::new(&file.path).components();
            let stays =
                !file.path.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)));
            ensure!(
                stays,
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
    fn a_manifest_is_read_and_names_nothing_elsewhere() {
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
