//! What goes into a bundle, in words.

use crate::packing::{BundleFile, IGNORE_FILE, LARGE_BYTES, Selection};
use indicatif::HumanBytes;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What is printed with `--dry-run`.
#[derive(Debug, Serialize)]
pub(super) struct Contents {
    file_name: String,
    bytes: u64,
    /// Of an archive nobody has looked: null.
    files: Option<Vec<Packed>>,
    left_out: Vec<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Packed {
    path: PathBuf,
    bytes: u64,
}

impl Contents {
    pub(super) fn of(bundle: &BundleFile) -> Self {
        let packed = |(path, bytes): (&Path, u64)| Packed {
            path: path.to_owned(),
            bytes,
        };
        let selection = bundle.selection();
        Self {
            file_name: bundle.name().to_owned(),
            bytes: bundle.bytes(),
            files: selection.map(|selection| selection.files().map(packed).collect()),
            left_out: selection.map_or_else(Vec::new, |selection| selection.left_out().to_vec()),
        }
    }

    pub(super) fn listed(&self) -> String {
        let mut lines = vec![format!(
            "{}: {}, not uploaded",
            self.file_name,
            HumanBytes(self.bytes)
        )];
        match &self.files {
            Some(files) => lines.extend(files.iter().map(|file| {
                format!(
                    "{:>12}  {}",
                    HumanBytes(file.bytes).to_string(),
                    file.path.display()
                )
            })),
            None => lines.push("an archive goes as it is".to_owned()),
        }
        lines.extend(
            self.left_out
                .iter()
                .map(|path| format!("{:>12}  {}", "left out", path.display())),
        );
        lines.join("\n")
    }
}

/// How much goes in, what does not, and what is strangely large.
pub(super) fn told(selection: &Selection, archive_bytes: u64) -> Vec<String> {
    /// Names that a line has room for.
    const NAMES: usize = 6;
    let (files, bytes) = selection
        .files()
        .fold((0_u64, 0_u64), |(files, all), (_, bytes)| {
            (files + 1, all + bytes)
        });
    let s = if files == 1 { "" } else { "s" };
    let mut lines = vec![format!(
        "packing {files} file{s} of {}, as an archive {}",
        HumanBytes(bytes),
        HumanBytes(archive_bytes)
    )];
    let left_out = selection.left_out();
    if !left_out.is_empty() {
        let mut names: Vec<_> = left_out
            .iter()
            .take(NAMES)
            .map(|path| path.display().to_string())
            .collect();
        if left_out.len() > NAMES {
            names.push(format!("{} more", left_out.len() - NAMES));
        }
        lines.push(format!(
            "left out: {} (a line !NAME in {IGNORE_FILE} has it go in)",
            names.join(", ")
        ));
    }
    for (path, bytes) in selection.files() {
        if bytes >= LARGE_BYTES {
            lines.push(format!(
                "note: {} has {}; if the agent does not need it to run, name it in {IGNORE_FILE}",
                path.display(),
                HumanBytes(bytes)
            ));
        }
    }
    lines
}
