//! The files of a folder that are packed into a bundle.

use super::rules::Rules;
use anyhow::{Context, bail, ensure};
use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

/// The files of a folder that are packed into the bundle.
#[derive(Debug)]
pub struct Selection {
    folder: PathBuf,
    /// Sorted by name, each folder before its content.
    entries: Vec<Entry>,
    left_out: Vec<PathBuf>,
}

/// An entry of the archive.
#[derive(Debug)]
pub struct Entry {
    pub path: PathBuf,
    pub kind: EntryKind,
}

/// Type of an entry.
#[derive(Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A folder, possibly empty.
    Folder,
    File {
        bytes: u64,
        /// Its owner may execute it.
        executable: bool,
    },
    Link {
        /// The link's target, unresolved.
        target: PathBuf,
    },
}

impl Selection {
    /// Selects the files of a folder.
    ///
    /// # Errors
    /// If the folder has no `agent.toml`, or an entry cannot be read or is neither file, folder nor link.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        ensure!(
            folder.join("agent.toml").is_file(),
            "there is no agent.toml in {}; the folder of a bundle needs one, see docs/start.md",
            folder.display()
        );
        let rules = Rules::read(folder)?;
        let mut selection = Self {
            folder: folder.to_owned(),
            entries: Vec::new(),
            left_out: Vec::new(),
        };
        selection.add_folder(Path::new(""), &rules)?;
        ensure!(
            selection
                .entries
                .iter()
                .any(|entry| entry.path == Path::new("agent.toml")),
            "{} leaves out agent.toml, which every bundle needs",
            super::IGNORE_FILE
        );
        Ok(selection)
    }

    /// Adds the content of a folder, whose path is relative to the bundle's.
    fn add_folder(&mut self, relative: &Path, rules: &Rules) -> anyhow::Result<()> {
        let reading = || format!("reading {}", self.folder.join(relative).display());
        let mut names = fs::read_dir(self.folder.join(relative))
            .with_context(reading)?
            .map(|entry| Ok(entry?.file_name()))
            .collect::<std::io::Result<Vec<_>>>()
            .with_context(reading)?;
        names.sort_unstable();
        for name in names {
            let path = relative.join(name);
            let absolute = self.folder.join(&path);
            let context = || format!("reading {}", absolute.display());
            let metadata = fs::symlink_metadata(&absolute).with_context(context)?;
            if rules.leaves_out(&path, metadata.is_dir()) {
                self.left_out.push(path);
                continue;
            }
            let kind = if metadata.is_dir() {
                EntryKind::Folder
            } else if metadata.is_file() {
                EntryKind::File {
                    bytes: metadata.len(),
                    executable: metadata.permissions().mode() & 0o100 != 0,
                }
            } else if metadata.is_symlink() {
                EntryKind::Link {
                    target: fs::read_link(&absolute).with_context(context)?,
                }
            } else {
                bail!(
                    "{} is neither file, folder nor link: it cannot be part of a bundle",
                    absolute.display()
                );
            };
            let is_folder = kind == EntryKind::Folder;
            self.entries.push(Entry {
                path: path.clone(),
                kind,
            });
            if is_folder {
                self.add_folder(&path, rules)?;
            }
        }
        Ok(())
    }

    /// The folder of the bundle.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// All packed entries, in the sequence of the archive.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The files, with their sizes in bytes.
    pub fn files(&self) -> impl Iterator<Item = (&Path, u64)> {
        self.entries.iter().filter_map(|entry| match entry.kind {
            EntryKind::File { bytes, .. } => Some((entry.path.as_path(), bytes)),
            _ => None,
        })
    }

    /// Files and folders that are left out, without the content of those folders.
    pub fn left_out(&self) -> &[PathBuf] {
        &self.left_out
    }
}
