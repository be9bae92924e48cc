use super::{
    budget::Budget,
    entry::{FOLDER_MODE, check_target, invalid, normalise, unusable, write_name, write_new},
    error::BundleError,
    links,
    node::Node,
    sink::{Sink, Special},
};
use fs_err::{self as fs, os::unix::fs::symlink};
use std::{
    collections::BTreeMap,
    fs::Permissions,
    io::{self, Read},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

/// The folder that grows while an archive is read. What is in it is known from memory, never asked
/// back from the disk, and symbolic links are made last: nothing can be written through one.
pub(super) struct Tree<'a> {
    into: PathBuf,
    budget: &'a Budget<'a>,
    nodes: BTreeMap<String, Node>,
    files: u64,
    folders: u64,
}

impl<'a> Tree<'a> {
    /// An empty tree in the folder `into`.
    pub fn new(into: &Path, budget: &'a Budget<'a>) -> Result<Self, BundleError> {
        fs::create_dir_all(into)?;
        fs::set_permissions(into, Permissions::from_mode(FOLDER_MODE))?;
        if fs::read_dir(into)?.next().is_some() {
            let what = format!("unpacking into {}: it is not empty", into.display());
            return Err(io::Error::new(io::ErrorKind::DirectoryNotEmpty, what).into());
        }
        Ok(Self {
            into: into.to_owned(),
            budget,
            nodes: BTreeMap::new(),
            files: 0,
            folders: 0,
        })
    }

    fn check_mode(entry: &str, mode: u32) -> Result<(), BundleError> {
        match mode & 0o6000 {
            0 => Ok(()),
            _ => Err(invalid(entry, "has a set-user-id or set-group-id bit")),
        }
    }

    /// Takes a place in the tree for something that is no folder.
    fn place(&mut self, entry: &str, node: Node) -> Result<PathBuf, BundleError> {
        let path = normalise(entry)?;
        if path.is_empty() {
            return Err(invalid(entry, "is the root, but not a folder"));
        }
        if let Some((parent, _)) = path.rsplit_once('/') {
            self.make_folder(entry, parent, false)?;
        }
        if self.nodes.contains_key(&path) {
            return Err(invalid(entry, "is in the archive twice"));
        }
        self.files += 1;
        let most = self.budget.limits().files;
        if self.files > most {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {most} files"
            )));
        }
        let target = self.into.join(&path);
        self.nodes.insert(path, node);
        Ok(target)
    }

    fn make_folder(&mut self, entry: &str, path: &str, named: bool) -> Result<(), BundleError> {
        match self.nodes.get_mut(path) {
            Some(Node::Folder { named: before }) => {
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
            self.make_folder(entry, parent, false)?;
        }
        self.folders += 1;
        let most = self.budget.limits().files;
        if self.folders > most {
            return Err(BundleError::Invalid(format!(
                "the archive has more than {most} folders"
            )));
        }
        let place = self.into.join(path);
        fs::create_dir(&place)?;
        fs::set_permissions(&place, Permissions::from_mode(FOLDER_MODE))?;
        self.nodes.insert(path.to_owned(), Node::Folder { named });
        Ok(())
    }

    /// The folder and what is in it, if it is not to be finished as a bundle: no links are made.
    pub fn into_parts(self) -> (PathBuf, BTreeMap<String, Node>) {
        (self.into, self.nodes)
    }

    /// The folder that holds `manifest`: the root (an empty path) or the single top folder.
    pub fn bundle_root(&self, manifest: &str) -> Option<String> {
        if self.nodes.contains_key(manifest) {
            return Some(String::new());
        }
        let mut top = self.nodes.iter().filter(|(path, _)| !path.contains('/'));
        match (top.next(), top.next()) {
            (Some((folder, Node::Folder { .. })), None)
                if self.nodes.contains_key(&format!("{folder}/{manifest}")) =>
            {
                Some(folder.clone())
            }
            _ => None,
        }
    }

    /// What is refused may be something else than a bundle, and then it helps to hear of it.
    pub fn explain_refusal(&self, error: BundleError) -> BundleError {
        let BundleError::Invalid(told) = error else {
            return error;
        };
        let has = |path: &str| self.nodes.contains_key(path);
        let mut tops = self.nodes.iter().filter(|(path, _)| !path.contains('/'));
        let only_top = tops.next().filter(|_| tops.next().is_none());
        BundleError::Invalid(match only_top {
            _ if has(".dockerenv") || (has("etc") && has("usr") && !has("agent.toml")) => format!(
                "{told}. This looks like the file system of a container (`docker export`): send its image, as \
                 `docker save` writes it"
            ),
            Some((name, Node::File)) if name.ends_with(".tar") => format!(
                "{told}. There is only {name:?}, itself an archive: if it is a container image, send that"
            ),
            _ => told,
        })
    }

    /// Checks that every link stays inside of the bundle's folder `root`, then makes the links.
    pub fn finish(self, root: &str) -> Result<(), BundleError> {
        for (path, node) in &self.nodes {
            if let Node::Link { target } = node {
                links::check(&self.nodes, root, path, target, &mut |bytes| {
                    self.budget.followed(bytes)
                })
                .map_err(|problem| invalid(path, problem))?;
            }
        }
        for (path, node) in &self.nodes {
            if let Node::Link { target } = node {
                symlink(target, self.into.join(path))?;
            }
        }
        Ok(())
    }
}

impl Sink for Tree<'_> {
    fn folder(&mut self, entry: &str, mode: u32) -> Result<(), BundleError> {
        Self::check_mode(entry, mode)?;
        let path = normalise(entry)?;
        if path.is_empty() {
            return Ok(());
        }
        self.make_folder(entry, &path, true)
    }

    fn file(&mut self, entry: &str, mode: u32, content: &mut dyn Read) -> Result<(), BundleError> {
        Self::check_mode(entry, mode)?;
        let target = self.place(entry, Node::File)?;
        write_new(entry, &target, mode, content, self.budget)
    }

    /// Checked and made by [`Tree::finish`].
    fn link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        check_target(entry, target)?;
        self.place(
            entry,
            Node::Link {
                target: target.to_owned(),
            },
        )?;
        Ok(())
    }

    /// Of a file that the archive has brought already.
    fn hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let existing = normalise(target)?;
        if self.nodes.get(&existing) != Some(&Node::File) {
            return Err(invalid(
                entry,
                format_args!(
                    "is a hard link to {target:?}, which is no earlier file of the archive"
                ),
            ));
        }
        let place = self.place(entry, Node::File)?;
        write_name(entry, &self.into.join(existing), &place)
    }

    fn special(&mut self, entry: &str, special: Special) -> Result<(), BundleError> {
        Err(unusable(
            entry,
            match special {
                Special::NullDevice | Special::Device => "a device",
                Special::Pipe => "a named pipe",
            },
        ))
    }
}
