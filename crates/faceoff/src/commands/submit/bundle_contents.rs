//! The content of a bundle as `faceoff submit` shows it: packed files and those that are left out.

use crate::packing::{BundleFile, IGNORE_FILE, LARGE_BYTES, Selection};
use indicatif::HumanBytes;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Output of `--dry-run`.
#[derive(Debug, Serialize)]
pub(super) struct BundleContents {
    file_name: String,
    bytes: u64,
    /// `null` for an archive, which is not opened.
    files: Option<Vec<PackedFile>>,
    left_out: Vec<PathBuf>,
}

#[derive(Debug, Serialize)]
struct PackedFile {
    path: PathBuf,
    bytes: u64,
}

impl BundleContents {
    pub(super) fn new(bundle: &BundleFile) -> Self {
        let packed_file = |(path, bytes): (&Path, u64)| PackedFile {
            path: path.to_owned(),
            bytes,
        };
        let selection = bundle.selection();
        Self {
            file_name: bundle.name().to_owned(),
            bytes: bundle.bytes(),
            files: selection.map(|selection| selection.files().map(packed_file).collect()),
            left_out: selection.map_or_else(Vec::new, |selection| selection.left_out().to_vec()),
        }
    }

    pub(super) fn text(&self) -> String {
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
            None => lines.push("an archive is uploaded unchanged".to_owned()),
        }
        lines.extend(
            self.left_out
                .iter()
                .map(|path| format!("{:>12}  {}", "left out", path.display())),
        );
        lines.join("\n")
    }
}

/// Number and size of the packed files, the files left out, and unusually large files.
pub(super) fn packing_summary(selection: &Selection, archive_bytes: u64) -> Vec<String> {
    /// Largest number of names in a line.
    const MAX_NAMES: usize = 6;
    let (files, bytes) = selection
        .files()
        .fold((0_u64, 0_u64), |(files, total_bytes), (_, bytes)| {
            (files + 1, total_bytes + bytes)
        });
    let plural = if files == 1 { "" } else { "s" };
    let mut lines = vec![format!(
        "packing {files} file{plural}, {} ({} compressed)",
        HumanBytes(bytes),
        HumanBytes(archive_bytes)
    )];
    let left_out = selection.left_out();
    if !left_out.is_empty() {
        let mut names: Vec<_> = left_out
            .iter()
            .take(MAX_NAMES)
            .map(|path| path.display().to_string())
            .collect();
        if left_out.len() > MAX_NAMES {
            names.push(format!("{} more", left_out.len() - MAX_NAMES));
        }
        lines.push(format!(
            "left out: {} (a line !NAME in {IGNORE_FILE} includes a file)",
            names.join(", ")
        ));
    }
    for (path, bytes) in selection.files() {
        if bytes >= LARGE_BYTES {
            lines.push(format!(
                "note: {} has {}; if the agent does not need it, name it in {IGNORE_FILE}",
                path.display(),
                HumanBytes(bytes)
            ));
        }
    }
    lines
}
