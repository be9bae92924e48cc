//! Writes the entries of an archive into a folder, as the files of a bundle.

use super::{
    budget::Budget,
    entry::{
        APPLE_DOUBLE, FOLDER_MODE, add_hard_link, check_target, invalid, is_named_like_metadata,
        is_system_file, make_folder, set_default_time, unusable, write_new,
    },
    error::BundleError,
    links,
    node::Node,
    plan::Plan,
    sink::{EntrySink, FileAttributes, Special},
};
use fs_err::{self as fs, os::unix::fs::symlink};
use std::{
    collections::BTreeMap,
    fs::Permissions,
    io::{self, Read},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

/// The folder that is filled while an archive is read. Its content is known from memory and never read back from the
/// disk, and symbolic links are created last, so nothing can be written through a link.
///
/// A folder is created when a file is put into it, or at the end. So an archive with too many folders is refused before
/// any is created; removing them would take even longer.
pub(super) struct Tree<'a> {
    dir: PathBuf,
    budget: &'a Budget<'a>,
    plan: Plan,
}

impl<'a> Tree<'a> {
    /// An empty tree in the folder `dir`.
    pub fn new(dir: &Path, budget: &'a Budget<'a>) -> Result<Self, BundleError> {
        fs::create_dir_all(dir)?;
        fs::set_permissions(dir, Permissions::from_mode(FOLDER_MODE))?;
        if fs::read_dir(dir)?.next().is_some() {
            let what = format!("unpacking into {}: it is not empty", dir.display());
            return Err(io::Error::new(io::ErrorKind::DirectoryNotEmpty, what).into());
        }
        Ok(Self {
            dir: dir.to_owned(),
            budget,
            plan: Plan::new(budget.limits().files),
        })
    }

    /// The plan. If an archive has a directory (a list of its entries), it is checked with the plan before anything is
    /// written.
    pub fn plan_mut(&mut self) -> &mut Plan {
        &mut self.plan
    }

    /// Resets the plan after that check; then the entries are added again with their contents.
    pub fn reset_plan(&mut self) {
        self.plan = Plan::new(self.budget.limits().files);
    }

    /// Creates the parent folders of `path`; returns its path on the disk.
    fn make_parents(&mut self, path: &str) -> Result<PathBuf, BundleError> {
        for folder in self.plan.missing_folders(path) {
            make_folder(&self.dir.join(&folder))?;
            self.plan.set_created(&folder);
        }
        Ok(self.dir.join(path))
    }

    /// The folder and its content, without finishing it as a bundle: symbolic links and empty folders are not created.
    pub fn into_parts(self) -> (PathBuf, BTreeMap<String, Node>) {
        (self.dir, self.plan.into_nodes())
    }

    /// The folder that contains `manifest`: the root (an empty path) or the single top-level folder.
    pub fn bundle_root(&self, manifest: &str) -> Option<String> {
        let nodes = self.plan.nodes();
        if nodes.contains_key(manifest) {
            return Some(String::new());
        }
        let mut top_level = nodes.iter().filter(|(path, _)| !path.contains('/'));
        match (top_level.next(), top_level.next()) {
            (Some((folder, Node::Folder { .. })), None)
                if nodes.contains_key(&format!("{folder}/{manifest}")) =>
            {
                Some(folder.clone())
            }
            _ => None,
        }
    }

    /// Adds a hint to an error if the archive looks like a container's file system or a nested archive.
    pub fn explain_refusal(&self, error: BundleError) -> BundleError {
        let BundleError::Invalid(message) = error else {
            return error;
        };
        let nodes = self.plan.nodes();
        let has = |path: &str| nodes.contains_key(path);
        let mut top_level = nodes.iter().filter(|(path, _)| !path.contains('/'));
        let only_top = top_level.next().filter(|_| top_level.next().is_none());
        BundleError::Invalid(match only_top {
            _ if has(".dockerenv") || (has("etc") && has("usr") && !has("agent.toml")) => format!(
                "{message}. This looks like the file system of a container (`docker export`): send its image, as \
                 `docker save` writes it"
            ),
            Some((name, Node::File)) if name.ends_with(".tar") => format!(
                "{message}. There is only {name:?}, itself an archive: if it is a container image, send that"
            ),
            _ => message,
        })
    }

    /// Checks that every link stays inside of the bundle's folder `root`, then creates the missing folders and, last,
    /// the links.
    pub fn finish(self, root: &str) -> Result<(), BundleError> {
        let nodes = self.plan.nodes();
        for (path, node) in nodes {
            if let Node::Link { target } = node {
                links::check(nodes, root, path, target, &mut |bytes| {
                    self.budget.count_link_bytes(bytes)
                })
                .map_err(|problem| invalid(path, problem))?;
            }
        }
        // The sort order puts a folder before its content.
        for (path, node) in nodes {
            if let Node::Folder {
                is_created: false, ..
            } = node
            {
                self.budget.check()?;
                make_folder(&self.dir.join(path))?;
            }
        }
        for (path, node) in nodes {
            if let Node::Link { target } = node {
                symlink(target, self.dir.join(path))?;
            }
        }
        // The content of a folder before the folder.
        for (path, node) in nodes.iter().rev() {
            if !matches!(node, Node::File) {
                self.budget.check()?;
                set_default_time(&self.dir.join(path))?;
            }
        }
        set_default_time(&self.dir)
    }
}

impl EntrySink for Tree<'_> {
    /// The folder is created by [`Tree::finish`], or with the first file in it.
    fn add_folder(&mut self, entry: &str) -> Result<(), BundleError> {
        if is_system_file(entry) {
            return Ok(());
        }
        self.plan.add_folder(entry)
    }

    fn add_file(
        &mut self,
        entry: &str,
        attributes: FileAttributes,
        content: &mut dyn Read,
    ) -> Result<(), BundleError> {
        if is_system_file(entry) {
            return Ok(());
        }
        let mut beginning = Vec::new();
        if is_named_like_metadata(entry) {
            (&mut *content)
                .take(APPLE_DOUBLE.len() as u64)
                .read_to_end(&mut beginning)
                .map_err(BundleError::from_read_error(entry))?;
            if beginning == APPLE_DOUBLE {
                return Ok(());
            }
        }
        let mut content = beginning.as_slice().chain(content);
        let path = self.plan.add_file(entry, attributes.mode)?;
        let path_on_disk = self.make_parents(&path)?;
        write_new(entry, &path_on_disk, attributes, &mut content, self.budget)
    }

    /// The link is checked and created by [`Tree::finish`].
    fn add_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        if is_system_file(entry) {
            return Ok(());
        }
        check_target(entry, target)?;
        self.plan.add_link(entry, target)
    }

    /// The target must be an earlier file of the archive.
    fn add_hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        if is_system_file(entry) {
            return Ok(());
        }
        let (existing, path) = self.plan.add_hard_link(entry, target)?;
        let path_on_disk = self.make_parents(&path)?;
        add_hard_link(entry, &self.dir.join(existing), &path_on_disk)
    }

    fn add_special(&mut self, entry: &str, special: Special) -> Result<(), BundleError> {
        Err(unusable(
            entry,
            match special {
                Special::OverlayfsWhiteout | Special::Device => "a device",
                Special::Pipe => "a named pipe",
            },
        ))
    }
}
