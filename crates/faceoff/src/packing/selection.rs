use super::rules::Rules;
use anyhow::{Context, bail, ensure};
use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

/// What of a folder goes into the bundle.
#[derive(Debug)]
pub struct Selection {
    folder: PathBuf,
    /// By name, a folder before what is in it.
    entries: Vec<Entry>,
    left_out: Vec<PathBuf>,
}

/// One name in the archive.
#[derive(Debug)]
pub struct Entry {
    pub path: PathBuf,
    pub kind: Kind,
}

/// What a name stands for.
#[derive(Debug, PartialEq, Eq)]
pub enum Kind {
    /// A folder, perhaps an empty one.
    Folder,
    File {
        bytes: u64,
        /// May its owner run it?
        executable: bool,
    },
    Link {
        /// Where to, as it says.
        target: PathBuf,
    },
}

impl Selection {
    /// Looks through a folder.
    ///
    /// # Errors
    /// If it has no `agent.toml`, something in it cannot be read, or is neither file nor folder nor link.
    pub fn of(folder: &Path) -> anyhow::Result<Self> {
        ensure!(
            folder.join("agent.toml").is_file(),
            "there is no agent.toml in {}; the folder of a bundle holds one, see docs/start.md",
            folder.display()
        );
        let rules = Rules::of(folder)?;
        let mut found = Self {
            folder: folder.to_owned(),
            entries: Vec::new(),
            left_out: Vec::new(),
        };
        found.look_into(Path::new(""), &rules)?;
        ensure!(
            found
                .entries
                .iter()
                .any(|entry| entry.path == Path::new("agent.toml")),
            "{} leaves agent.toml out, without which there is no bundle",
            super::IGNORE_FILE
        );
        Ok(found)
    }

    fn look_into(&mut self, at: &Path, rules: &Rules) -> anyhow::Result<()> {
        let reading = || format!("looking into {}", self.folder.join(at).display());
        let mut names = fs::read_dir(self.folder.join(at))
            .with_context(reading)?
            .map(|entry| Ok(entry?.file_name()))
            .collect::<std::io::Result<Vec<_>>>()
            .with_context(reading)?;
        names.sort_unstable();
        for name in names {
            let path = at.join(name);
            let place = self.folder.join(&path);
            let looking = || format!("looking at {}", place.display());
            let metadata = fs::symlink_metadata(&place).with_context(looking)?;
            if rules.leave_out(&path, metadata.is_dir()) {
                self.left_out.push(path);
                continue;
            }
            let kind = if metadata.is_dir() {
                Kind::Folder
            } else if metadata.is_file() {
                Kind::File {
                    bytes: metadata.len(),
                    executable: metadata.permissions().mode() & 0o100 != 0,
                }
            } else if metadata.is_symlink() {
                Kind::Link {
                    target: fs::read_link(&place).with_context(looking)?,
                }
            } else {
                bail!(
                    "{} is neither file nor folder nor link: it cannot be in a bundle",
                    place.display()
                );
            };
            let is_folder = kind == Kind::Folder;
            self.entries.push(Entry {
                path: path.clone(),
                kind,
            });
            if is_folder {
                self.look_into(&path, rules)?;
            }
        }
        Ok(())
    }

    /// Where it was looked.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// All that goes in, in the order of the archive.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The files, with their sizes in bytes.
    pub fn files(&self) -> impl Iterator<Item = (&Path, u64)> {
        self.entries.iter().filter_map(|entry| match entry.kind {
            Kind::File { bytes, .. } => Some((entry.path.as_path(), bytes)),
            _ => None,
        })
    }

    /// What stays out; of a folder that does, itself alone.
    pub fn left_out(&self) -> &[PathBuf] {
        &self.left_out
    }
}
