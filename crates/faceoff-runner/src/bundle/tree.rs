use super::{
    budget::Budget,
    entry::{FOLDER_MODE, check_target, invalid, make_folder, unusable, write_name, write_new},
    error::BundleError,
    links,
    node::Node,
    plan::Plan,
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
///
/// A folder is made when a file is put into it, or at the end: an archive of too many folders is refused before
/// there is one of them to be made, and to be removed again, which is slower still.
pub(super) struct Tree<'a> {
    into: PathBuf,
    budget: &'a Budget<'a>,
    plan: Plan,
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
            plan: Plan::new(budget.limits().files),
        })
    }

    /// Where an archive that lists what it holds is checked before any of it is written.
    pub fn plan_mut(&mut self) -> &mut Plan {
        &mut self.plan
    }

    /// Forgets what has been checked, of which nothing is written: it comes again with its content.
    pub fn forget_plan(&mut self) {
        self.plan = Plan::new(self.budget.limits().files);
    }

    /// The place on the disk of something that is no folder, and those that lead there.
    fn make_way(&mut self, path: &str) -> Result<PathBuf, BundleError> {
        for folder in self.plan.missing_folders(path) {
            make_folder(&self.into.join(&folder))?;
            self.plan.set_made(&folder);
        }
        Ok(self.into.join(path))
    }

    /// The folder and what is in it, if it is not to be finished as a bundle: no links are made, and no folders
    /// that hold no file.
    pub fn into_parts(self) -> (PathBuf, BTreeMap<String, Node>) {
        (self.into, self.plan.into_nodes())
    }

    /// The folder that holds `manifest`: the root (an empty path) or the single top folder.
    pub fn bundle_root(&self, manifest: &str) -> Option<String> {
        let nodes = self.plan.nodes();
        if nodes.contains_key(manifest) {
            return Some(String::new());
        }
        let mut top = nodes.iter().filter(|(path, _)| !path.contains('/'));
        match (top.next(), top.next()) {
            (Some((folder, Node::Folder { .. })), None)
                if nodes.contains_key(&format!("{folder}/{manifest}")) =>
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
        let nodes = self.plan.nodes();
        let has = |path: &str| nodes.contains_key(path);
        let mut tops = nodes.iter().filter(|(path, _)| !path.contains('/'));
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

    /// Checks that every link stays inside of the bundle's folder `root`, then makes the folders that are not there
    /// yet and, last, the links.
    pub fn finish(self, root: &str) -> Result<(), BundleError> {
        let nodes = self.plan.nodes();
        for (path, node) in nodes {
            if let Node::Link { target } = node {
                links::check(nodes, root, path, target, &mut |bytes| {
                    self.budget.followed(bytes)
                })
                .map_err(|problem| invalid(path, problem))?;
            }
        }
        // A folder comes before what is in it.
        for (path, node) in nodes {
            if let Node::Folder { is_made: false, .. } = node {
                self.budget.check()?;
                make_folder(&self.into.join(path))?;
            }
        }
        for (path, node) in nodes {
            if let Node::Link { target } = node {
                symlink(target, self.into.join(path))?;
            }
        }
        Ok(())
    }
}

impl Sink for Tree<'_> {
    /// Made by [`Tree::finish`], or with the first file in it.
    fn folder(&mut self, entry: &str, mode: u32) -> Result<(), BundleError> {
        self.plan.add_folder(entry, mode)
    }

    fn file(&mut self, entry: &str, mode: u32, content: &mut dyn Read) -> Result<(), BundleError> {
        let path = self.plan.add_file(entry, mode)?;
        let place = self.make_way(&path)?;
        write_new(entry, &place, mode, content, self.budget)
    }

    /// Checked and made by [`Tree::finish`].
    fn link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        check_target(entry, target)?;
        self.plan.add_link(entry, target)
    }

    /// Of a file that the archive has brought already.
    fn hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let (existing, path) = self.plan.add_hard_link(entry, target)?;
        let place = self.make_way(&path)?;
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
