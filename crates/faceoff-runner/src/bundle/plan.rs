//! The plan of a bundle's tree: names and kinds of an archive's entries, checked before anything is written.

use super::{
    entry::{invalid, normalise},
    error::BundleError,
    node::Node,
};
use std::collections::BTreeMap;

/// The names and kinds of an archive's entries, in memory. The plan checks everything that does not depend on the content:
/// names, modes, paths and numbers.
pub(super) struct Plan {
    nodes: BTreeMap<String, Node>,
    /// Maximum number of files and links, and also of folders.
    max_files: u64,
    /// Number of files and links so far.
    files: u64,
    /// Number of folders so far.
    folders: u64,
}

impl Plan {
    pub fn new(max_files: u64) -> Self {
        Self {
            nodes: BTreeMap::new(),
            max_files,
            files: 0,
            folders: 0,
        }
    }

    pub fn nodes(&self) -> &BTreeMap<String, Node> {
        &self.nodes
    }

    pub fn into_nodes(self) -> BTreeMap<String, Node> {
        self.nodes
    }

    /// Adds a folder that has its own entry. `entry` is here and below the name in the archive, for messages.
    pub fn add_folder(&mut self, entry: &str) -> Result<(), BundleError> {
        let path = normalise(entry)?;
        if path.is_empty() {
            return Ok(());
        }
        self.insert_folder(entry, &path, true)
    }

    /// Adds a file. Returns its path.
    pub fn add_file(&mut self, entry: &str, mode: u32) -> Result<String, BundleError> {
        check_mode(entry, mode)?;
        self.insert_node(entry, Node::File)
    }

    /// Adds a symbolic link. Its target is checked later, when all names are known.
    pub fn add_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let target = target.to_owned();
        self.insert_node(entry, Node::Link { target })?;
        Ok(())
    }

    /// Adds another name of an earlier file of the archive. Returns the path of that file and the new path.
    pub fn add_hard_link(
        &mut self,
        entry: &str,
        target: &str,
    ) -> Result<(String, String), BundleError> {
        let existing = normalise(target)?;
        if self.nodes.get(&existing) != Some(&Node::File) {
            return Err(invalid(
                entry,
                format_args!(
                    "is a hard link to {target:?}, which is no earlier file of the archive"
                ),
            ));
        }
        let path = self.insert_node(entry, Node::File)?;
        Ok((existing, path))
    }

    /// The parent folders of `path` that do not exist on the disk yet, the topmost first.
    pub fn missing_folders(&self, path: &str) -> Vec<String> {
        let is_missing = |folder: &str| {
            matches!(
                self.nodes.get(folder),
                Some(Node::Folder {
                    is_created: false,
                    ..
                })
            )
        };
        let mut missing = Vec::new();
        let mut remaining = path;
        // The parents of an existing folder exist, too.
        while let Some((folder, _)) = remaining.rsplit_once('/') {
            if !is_missing(folder) {
                break;
            }
            missing.push(folder.to_owned());
            remaining = folder;
        }
        missing.reverse();
        missing
    }

    /// Marks a folder as existing on the disk.
    pub fn set_created(&mut self, folder: &str) {
        if let Some(Node::Folder { is_created, .. }) = self.nodes.get_mut(folder) {
            *is_created = true;
        }
    }

    /// Adds a node that is not a folder.
    fn insert_node(&mut self, entry: &str, node: Node) -> Result<String, BundleError> {
        let path = normalise(entry)?;
        if path.is_empty() {
            return Err(invalid(entry, "is the root, but not a folder"));
        }
        if let Some((parent, _)) = path.rsplit_once('/') {
            self.insert_folder(entry, parent, false)?;
        }
        if self.nodes.contains_key(&path) {
            return Err(invalid(entry, "is in the archive twice"));
        }
        self.files += 1;
        if self.files > self.max_files {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {} files",
                self.max_files
            )));
        }
        self.nodes.insert(path.clone(), node);
        Ok(path)
    }

    /// Adds a folder and its parents; these are a few hundred at most, because the length of a path is limited.
    fn insert_folder(
        &mut self,
        entry: &str,
        path: &str,
        has_own_entry: bool,
    ) -> Result<(), BundleError> {
        match self.nodes.get_mut(path) {
            Some(Node::Folder {
                has_own_entry: had_own_entry,
                ..
            }) => {
                if has_own_entry && *had_own_entry {
                    return Err(invalid(entry, "is in the archive twice"));
                }
                *had_own_entry |= has_own_entry;
                return Ok(());
            }
            Some(Node::File) => {
                return Err(invalid(
                    entry,
                    format_args!("needs {path:?} to be a folder, but it is a file"),
                ));
            }
            Some(Node::Link { .. }) => {
                return Err(invalid(
                    entry,
                    format_args!("goes through the link {path:?}"),
                ));
            }
            None => {}
        }
        if let Some((parent, _)) = path.rsplit_once('/') {
            self.insert_folder(entry, parent, false)?;
        }
        self.folders += 1;
        if self.folders > self.max_files {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {} folders",
                self.max_files
            )));
        }
        let is_created = false;
        self.nodes.insert(
            path.to_owned(),
            Node::Folder {
                has_own_entry,
                is_created,
            },
        );
        Ok(())
    }
}

fn check_mode(entry: &str, mode: u32) -> Result<(), BundleError> {
    match mode & 0o6000 {
        0 => Ok(()),
        _ => Err(invalid(entry, "has a set-user-id or set-group-id bit")),
    }
}
