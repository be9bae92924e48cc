use super::{
    entry::{invalid, normalise},
    error::BundleError,
    node::Node,
};
use std::collections::BTreeMap;

/// The names of an archive and what they are, in memory. What an entry is refused for before its content is
/// looked at (name, mode, place, number) is refused here.
pub(super) struct Plan {
    nodes: BTreeMap<String, Node>,
    /// Most files and links, and most folders.
    most: u64,
    files: u64,
    folders: u64,
}

impl Plan {
    pub fn new(most: u64) -> Self {
        Self {
            nodes: BTreeMap::new(),
            most,
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

    /// Adds a folder that the archive names.
    pub fn add_folder(&mut self, entry: &str, mode: u32) -> Result<(), BundleError> {
        check_mode(entry, mode)?;
        let path = normalise(entry)?;
        if path.is_empty() {
            return Ok(());
        }
        self.place_folder(entry, &path, true)
    }

    /// Adds a file. Returns its path.
    pub fn add_file(&mut self, entry: &str, mode: u32) -> Result<String, BundleError> {
        check_mode(entry, mode)?;
        self.place(entry, Node::File)
    }

    /// Adds a symbolic link. Where it leads can be checked when all names are known.
    pub fn add_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let target = target.to_owned();
        self.place(entry, Node::Link { target })?;
        Ok(())
    }

    /// Adds another name of a file that the archive has brought already. Returns the path of that file and the new one.
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
        let path = self.place(entry, Node::File)?;
        Ok((existing, path))
    }

    /// The folders on the way to `path` that are not on the disk, the topmost first.
    pub fn missing_folders(&self, path: &str) -> Vec<String> {
        let is_missing = |folder: &str| {
            matches!(
                self.nodes.get(folder),
                Some(Node::Folder { is_made: false, .. })
            )
        };
        let mut missing = Vec::new();
        let mut rest = path;
        // What leads to a folder on the disk is there, too.
        while let Some((folder, _)) = rest.rsplit_once('/') {
            if !is_missing(folder) {
                break;
            }
            missing.push(folder.to_owned());
            rest = folder;
        }
        missing.reverse();
        missing
    }

    /// A folder is on the disk from now on.
    pub fn set_made(&mut self, folder: &str) {
        if let Some(Node::Folder { is_made, .. }) = self.nodes.get_mut(folder) {
            *is_made = true;
        }
    }

    /// Takes a place for something that is no folder.
    fn place(&mut self, entry: &str, node: Node) -> Result<String, BundleError> {
        let path = normalise(entry)?;
        if path.is_empty() {
            return Err(invalid(entry, "is the root, but not a folder"));
        }
        if let Some((parent, _)) = path.rsplit_once('/') {
            self.place_folder(entry, parent, false)?;
        }
        if self.nodes.contains_key(&path) {
            return Err(invalid(entry, "is in the archive twice"));
        }
        self.files += 1;
        if self.files > self.most {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {} files",
                self.most
            )));
        }
        self.nodes.insert(path.clone(), node);
        Ok(path)
    }

    /// Takes places for a folder and those on the way to it: some hundred at most, since a path is short.
    fn place_folder(&mut self, entry: &str, path: &str, named: bool) -> Result<(), BundleError> {
        match self.nodes.get_mut(path) {
            Some(Node::Folder { named: before, .. }) => {
                if named && *before {
                    return Err(invalid(entry, "is in the archive twice"));
                }
                *before |= named;
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
            self.place_folder(entry, parent, false)?;
        }
        self.folders += 1;
        if self.folders > self.most {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {} folders",
                self.most
            )));
        }
        let is_made = false;
        self.nodes
            .insert(path.to_owned(), Node::Folder { named, is_made });
        Ok(())
    }
}

fn check_mode(entry: &str, mode: u32) -> Result<(), BundleError> {
    match mode & 0o6000 {
        0 => Ok(()),
        _ => Err(invalid(entry, "has a set-user-id or set-group-id bit")),
    }
}
