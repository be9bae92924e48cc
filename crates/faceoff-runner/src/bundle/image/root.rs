//! The root folder of a container image, to which its *layers* (archives) are applied one over another. A layer hides
//! entries of lower layers by *whiteouts*: empty files with special names.

use super::messages::{dockerfile_hint, invalid};
use crate::bundle::{
    budget::Budget,
    entry::{
        PATH_MAX_BYTES, add_hard_link, check_target, invalid as invalid_entry, make_folder,
        normalise, set_default_time, write_new,
    },
    error::BundleError,
    sink::{EntrySink, FileAttributes, Special},
};
use fs_err::{self as fs, os::unix::fs::symlink};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    io::Read,
    path::{Path, PathBuf},
};

/// As many links as Linux follows on one path.
const MAX_LINKS: usize = 40;
/// Folders of the sandbox: empty in every image, used as mount points. Files of layers in them are unpacked and
/// counted like others, because hard links to them may exist elsewhere, and removed at the end.
const SANDBOX_FOLDERS: [&str; 5] = ["dev", "proc", "run", "sys", "tmp"];
/// Files that the sandbox covers, and network configuration files, which contain only the agent itself.
const SANDBOX_FILES: [(&str, &str); 5] = [
    ("group", ""),
    ("hostname", "agent\n"),
    ("hosts", faceoff_sandbox::HOSTS),
    ("passwd", ""),
    ("resolv.conf", ""),
];
/// Folder of the agent in its image.
const AGENT_FOLDER: &str = "agent";
/// Name prefix of a whiteout, with which a layer removes an entry of the layers below.
const WHITEOUT_PREFIX: &str = ".wh.";
/// Whiteout that removes all entries that a folder has from layers below.
const OPAQUE_WHITEOUT: &str = ".wh..wh..opq";
/// Name prefix of metadata of aufs, the file system from which whiteouts come. Container engines skip these files, too.
const WHITEOUT_METADATA_PREFIX: &str = ".wh..wh.";

/// The root folder to which layers are applied. Its content is known from memory and never read back from the disk,
/// which contains only folders and files until all layers are applied. Symbolic links are resolved in memory, inside
/// of the root, and created last. So no link can reach a file of the host, whatever its target is. A folder is created
/// when a file is put into it, or at the end. So an image with too many folders is refused before they are created.
pub(super) struct Root<'a> {
    disk_path: PathBuf,
    budget: &'a Budget<'a>,
    top_folder: Folder,
    /// The layer that is being applied, from 1.
    layer: u32,
    /// Number of files and links created so far.
    files: u64,
    /// Number of folders added so far.
    folders: u64,
}

#[derive(Debug, Default)]
struct Folder {
    children: BTreeMap<String, Node>,
    /// Does it exist on the disk? Then its parents exist, too.
    is_created: bool,
}

#[derive(Debug)]
struct Node {
    /// The last layer with an entry for it: a whiteout hides nodes of the layers below its own.
    layer: u32,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Folder(Folder),
    File,
    Link(String),
    /// A device, pipe or socket: it has a name but does not exist on the disk.
    Special,
}

/// Location of a node: its folder in the root, as path components without links, and its name.
struct Location {
    folder: Vec<String>,
    name: String,
}

impl Location {
    fn path(&self) -> String {
        let mut path = self.folder.join("/");
        if !path.is_empty() {
            path.push('/');
        }
        path + &self.name
    }
}

impl Folder {
    /// The child folder `name`.
    fn folder(&self, name: &str) -> Option<&Self> {
        match self.children.get(name).map(|node| &node.kind) {
            Some(Kind::Folder(folder)) => Some(folder),
            _ => None,
        }
    }

    fn descendant(&self, path: &[String]) -> Option<&Self> {
        path.iter()
            .try_fold(self, |folder, name| folder.folder(name))
    }

    fn descendant_mut(&mut self, path: &[String]) -> Option<&mut Self> {
        path.iter()
            .try_fold(self, |folder, name| match folder.children.get_mut(name) {
                Some(Node {
                    kind: Kind::Folder(folder),
                    ..
                }) => Some(folder),
                _ => None,
            })
    }

    /// Removes the nodes of layers below `layer`.
    fn remove_children_below(
        &mut self,
        disk_path: &Path,
        layer: u32,
        budget: &Budget<'_>,
    ) -> Result<(), BundleError> {
        let mut result = Ok(());
        self.children.retain(|name, node| {
            result.is_err()
                || match node.remove_lower_layers(&disk_path.join(name), layer, budget) {
                    Ok(remains) => remains,
                    Err(error) => {
                        result = Err(error);
                        true
                    }
                }
        });
        result
    }
}

impl Node {
    /// Removes the parts of this node that belong to layers below `layer`; returns whether the node remains.
    fn remove_lower_layers(
        &mut self,
        disk_path: &Path,
        layer: u32,
        budget: &Budget<'_>,
    ) -> Result<bool, BundleError> {
        budget.count_lookup(disk_path.as_os_str().len())?;
        match &mut self.kind {
            Kind::Folder(folder) => {
                folder.remove_children_below(disk_path, layer, budget)?;
                let remains = self.layer == layer || !folder.children.is_empty();
                if !remains && folder.is_created {
                    fs::remove_dir(disk_path)?;
                }
                Ok(remains)
            }
            _ if self.layer == layer => Ok(true),
            Kind::File => {
                fs::remove_file(disk_path)?;
                Ok(false)
            }
            Kind::Link(_) | Kind::Special => Ok(false),
        }
    }
}

impl<'a> Root<'a> {
    /// Creates an empty root in a new folder.
    pub(super) fn new(disk_path: &Path, budget: &'a Budget<'a>) -> Result<Self, BundleError> {
        make_folder(disk_path)?;
        Ok(Self {
            disk_path: disk_path.to_owned(),
            budget,
            top_folder: Folder {
                children: BTreeMap::new(),
                is_created: true,
            },
            layer: 0,
            files: 0,
            folders: 0,
        })
    }

    /// Starts the next layer.
    pub(super) const fn begin_layer(&mut self) {
        self.layer += 1;
    }

    fn path_on_disk(&self, folder: &[String]) -> PathBuf {
        self.disk_path.join(folder.join("/"))
    }

    /// Resolves a path: links are followed inside of the root, and the parent of the root is the root itself. Missing
    /// components resolve to the location where they would be created.
    fn resolve(&self, entry: &str, path: &str) -> Result<Vec<String>, BundleError> {
        // The resolved parts of the path, with their folders if they exist.
        let mut resolved: Vec<(String, Option<&Folder>)> = Vec::new();
        // The parts that are still to be resolved, the next one last.
        let mut pending: Vec<String> = reversed_parts(path);
        let mut links = 0;
        while let Some(part) = pending.pop() {
            self.budget.count_lookup(part.len())?;
            if part == ".." {
                resolved.pop();
                continue;
            }
            let current = resolved
                .last()
                .map_or(Some(&self.top_folder), |(_, folder)| *folder);
            match current.and_then(|current| current.children.get(&part)) {
                None => resolved.push((part, None)),
                Some(node) => match &node.kind {
                    Kind::Folder(folder) => resolved.push((part, Some(folder))),
                    Kind::File | Kind::Special => {
                        let shown: String = part.chars().take(200).collect();
                        return Err(invalid_entry(
                            entry,
                            format_args!("needs {shown:?} to be a folder, but it is a file"),
                        ));
                    }
                    Kind::Link(target) => {
                        links += 1;
                        if links > MAX_LINKS {
                            return Err(invalid_entry(
                                entry,
                                format_args!("goes through more than {MAX_LINKS} links"),
                            ));
                        }
                        self.budget.count_lookup(target.len())?;
                        if target.starts_with('/') {
                            resolved.clear();
                        }
                        pending.extend(reversed_parts(target));
                    }
                },
            }
        }
        let path: Vec<String> = resolved.into_iter().map(|(part, _)| part).collect();
        if path.iter().map(|part| part.len() + 1).sum::<usize>() > PATH_MAX_BYTES {
            return Err(invalid_entry(
                entry,
                format_args!("leads to too long a path: at most {PATH_MAX_BYTES} bytes"),
            ));
        }
        Ok(path)
    }

    /// Location of a path in a layer: its folders resolved, its last component not followed. `None` for the root. Some
    /// builders write paths that begin with a slash, which means the image's root.
    fn location(&self, entry: &str, path: &str) -> Result<Option<Location>, BundleError> {
        let path = match path.trim_start_matches('/') {
            "" if !path.is_empty() => return Ok(None),
            path => normalise(path)?,
        };
        if path.is_empty() {
            return Ok(None);
        }
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", &path));
        Ok(Some(Location {
            folder: self.resolve(entry, folder)?,
            name: name.to_owned(),
        }))
    }

    /// Location for an entry. `None` if there is nothing to create: the entry is the root, or a whiteout, which is
    /// applied here.
    fn location_for(&mut self, entry: &str) -> Result<Option<Location>, BundleError> {
        let Some(location) = self.location(entry, entry)? else {
            return Ok(None);
        };
        if let Some(hidden) = location.name.strip_prefix(WHITEOUT_PREFIX) {
            self.white_out(entry, &location, hidden)?;
            return Ok(None);
        }
        Ok(Some(location))
    }

    /// Removes the nodes of layers below, regardless of the whiteout's position in its own layer.
    fn white_out(
        &mut self,
        entry: &str,
        location: &Location,
        hidden: &str,
    ) -> Result<(), BundleError> {
        let (layer, budget, dir) = (self.layer, self.budget, self.path_on_disk(&location.folder));
        let Some(folder) = self.top_folder.descendant_mut(&location.folder) else {
            return Ok(());
        };
        if location.name == OPAQUE_WHITEOUT {
            return folder.remove_children_below(&dir, layer, budget);
        }
        if location.name.starts_with(WHITEOUT_METADATA_PREFIX) {
            return Ok(());
        }
        if matches!(hidden, "" | "." | "..") {
            return Err(invalid_entry(entry, "is a whiteout of no possible name"));
        }
        if let Some(node) = folder.children.get_mut(hidden)
            && !node.remove_lower_layers(&dir.join(hidden), layer, budget)?
        {
            folder.children.remove(hidden);
        }
        Ok(())
    }

    /// Frees the location for another node: adds its parent folders, and removes the existing node.
    fn free_location(
        &mut self,
        entry: &str,
        location: &Location,
    ) -> Result<&mut Folder, BundleError> {
        self.add_folders(&location.folder)?;
        let disk_path = self.path_on_disk(&location.folder).join(&location.name);
        let folder = self
            .top_folder
            .descendant_mut(&location.folder)
            .ok_or_else(|| invalid_entry(entry, "needs a folder that does not exist"))?;
        match folder.children.remove(&location.name).map(|node| node.kind) {
            Some(Kind::Folder(existing)) if existing.is_created => fs::remove_dir_all(disk_path)?,
            Some(Kind::File) => fs::remove_file(disk_path)?,
            Some(Kind::Folder(_) | Kind::Link(_) | Kind::Special) | None => {}
        }
        Ok(folder)
    }

    /// Adds a node that is not a folder. An existing node is removed, because the later entry of an archive replaces
    /// the earlier one. A file is always created as a new one, because other names of the old file keep its content.
    fn put(
        &mut self,
        entry: &str,
        location: &Location,
        kind: Kind,
    ) -> Result<PathBuf, BundleError> {
        self.files += 1;
        let max = self.budget.limits().files;
        if self.files > max {
            return Err(invalid(format_args!(
                "has more than {max} files in all layers"
            )));
        }
        let layer = self.layer;
        let is_written = matches!(kind, Kind::File);
        let folder = self.free_location(entry, location)?;
        folder
            .children
            .insert(location.name.clone(), Node { layer, kind });
        if is_written {
            self.make_parents(&location.folder)?;
        }
        Ok(self.path_on_disk(&location.folder).join(&location.name))
    }

    fn add_folders(&mut self, path: &[String]) -> Result<(), BundleError> {
        let max = self.budget.limits().files;
        let mut folder = &mut self.top_folder;
        for name in path {
            let node = match folder.children.entry(name.clone()) {
                Entry::Occupied(existing) => existing.into_mut(),
                Entry::Vacant(free) => {
                    self.folders += 1;
                    if self.folders > max {
                        return Err(invalid(format_args!(
                            "has more than {max} folders in all layers"
                        )));
                    }
                    free.insert(Node {
                        layer: self.layer,
                        kind: Kind::Folder(Folder::default()),
                    })
                }
            };
            folder = match &mut node.kind {
                Kind::Folder(child) => child,
                Kind::File | Kind::Link(_) | Kind::Special => {
                    return Err(invalid(format_args!("needs {name:?} to be a folder")));
                }
            };
        }
        Ok(())
    }

    /// Creates the folders of a path that do not exist on the disk yet.
    fn make_parents(&mut self, path: &[String]) -> Result<(), BundleError> {
        let (mut parent, mut disk_path) = (&mut self.top_folder, self.disk_path.clone());
        for name in path {
            disk_path.push(name);
            let Some(Node {
                kind: Kind::Folder(folder),
                ..
            }) = parent.children.get_mut(name)
            else {
                return Err(invalid(format_args!("needs {name:?} to be a folder")));
            };
            if !folder.is_created {
                make_folder(&disk_path)?;
                folder.is_created = true;
            }
            parent = folder;
        }
        Ok(())
    }

    /// Completes the root after all layers: creates the sandbox's files and folders, the empty folders, and the links.
    /// Returns the agent's folder, which is a real folder with a real file `manifest`; neither is a link.
    pub(super) fn finish(mut self, manifest: &str) -> Result<PathBuf, BundleError> {
        self.begin_layer();
        let agent = match self
            .top_folder
            .children
            .get(AGENT_FOLDER)
            .map(|node| &node.kind)
        {
            Some(Kind::Folder(agent)) => agent,
            Some(Kind::File | Kind::Link(_) | Kind::Special) => {
                return Err(invalid(format_args!(
                    "has something other than a folder as /{AGENT_FOLDER}; {}",
                    dockerfile_hint()
                )));
            }
            None => {
                return Err(invalid(format_args!(
                    "has no /{AGENT_FOLDER}; {}",
                    dockerfile_hint()
                )));
            }
        };
        match agent.children.get(manifest).map(|node| &node.kind) {
            Some(Kind::File) => {}
            Some(Kind::Folder(_) | Kind::Link(_) | Kind::Special) => {
                return Err(invalid(format_args!(
                    "has something other than a file as /{AGENT_FOLDER}/{manifest}"
                )));
            }
            None => {
                return Err(invalid(format_args!(
                    "has no /{AGENT_FOLDER}/{manifest}; {}",
                    dockerfile_hint()
                )));
            }
        }
        if let Some(Kind::File | Kind::Link(_) | Kind::Special) =
            self.top_folder.children.get("etc").map(|node| &node.kind)
        {
            return Err(invalid("has something other than a folder as /etc"));
        }
        for (name, content) in SANDBOX_FILES {
            let location = Location {
                folder: vec!["etc".to_owned()],
                name: name.to_owned(),
            };
            let disk_path = self.put(name, &location, Kind::File)?;
            let attributes = FileAttributes {
                mode: 0o644,
                modified_s: None,
            };
            write_new(
                name,
                &disk_path,
                attributes,
                &mut content.as_bytes(),
                self.budget,
            )?;
        }
        for name in SANDBOX_FOLDERS {
            let location = Location {
                folder: Vec::new(),
                name: name.to_owned(),
            };
            self.free_location(name, &location)?;
            self.add_folders(&[name.to_owned()])?;
        }
        make_folders(&mut self.top_folder, &self.disk_path, self.budget)?;
        make_links_and_set_times(&self.top_folder, &self.disk_path, self.budget)?;
        Ok(self.disk_path.join(AGENT_FOLDER))
    }
}

impl EntrySink for Root<'_> {
    /// An existing folder stays unchanged, because all folders have the same mode.
    fn add_folder(&mut self, entry: &str) -> Result<(), BundleError> {
        let Some(location) = self.location_for(entry)? else {
            return Ok(());
        };
        let layer = self.layer;
        let mut path = location.folder.clone();
        path.push(location.name.clone());
        if let Some(parent) = self.top_folder.descendant_mut(&location.folder)
            && let Some(node) = parent.children.get_mut(&location.name)
            && matches!(node.kind, Kind::Folder(_))
        {
            node.layer = layer;
            return Ok(());
        }
        self.free_location(entry, &location)?;
        self.add_folders(&path)
    }

    /// Set-id bits are dropped: they have no effect in the sandbox, and many images have some.
    fn add_file(
        &mut self,
        entry: &str,
        attributes: FileAttributes,
        content: &mut dyn Read,
    ) -> Result<(), BundleError> {
        let Some(location) = self.location_for(entry)? else {
            return Ok(());
        };
        let disk_path = self.put(entry, &location, Kind::File)?;
        write_new(entry, &disk_path, attributes, content, self.budget)
    }

    /// [`Root::finish`] creates the link on the disk. It may point anywhere, because it is followed only inside of the
    /// sandbox.
    fn add_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let Some(location) = self.location_for(entry)? else {
            return Ok(());
        };
        check_target(entry, target)?;
        self.put(entry, &location, Kind::Link(target.to_owned()))?;
        Ok(())
    }

    /// Adds another name of a file or link of this layer or a layer below. The folders of both names are resolved; the
    /// last components are not followed.
    fn add_hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let Some(location) = self.location_for(entry)? else {
            return Ok(());
        };
        let shown: String = target.chars().take(200).collect();
        let missing_file = || {
            invalid_entry(
                entry,
                format_args!(
                    "is a hard link to {shown:?}, which is no file of this layer or one below"
                ),
            )
        };
        let existing = self.location(entry, target)?.ok_or_else(missing_file)?;
        let folder = self
            .top_folder
            .descendant(&existing.folder)
            .ok_or_else(missing_file)?;
        let kind = match folder.children.get(&existing.name).map(|node| &node.kind) {
            Some(Kind::File) => Kind::File,
            Some(Kind::Link(target)) => Kind::Link(target.clone()),
            Some(Kind::Special) => Kind::Special,
            Some(Kind::Folder(_)) | None => return Err(missing_file()),
        };
        // Archivers write a hard link to itself if a file is given twice.
        if existing.path() == location.path() {
            return Ok(());
        }
        // The link would first remove its own target.
        if format!("{}/", existing.path()).starts_with(&format!("{}/", location.path())) {
            return Err(invalid_entry(
                entry,
                format_args!("is a hard link to what it replaces: {shown:?}"),
            ));
        }
        let is_file = matches!(kind, Kind::File);
        let disk_path = self.put(entry, &location, kind)?;
        if is_file {
            let existing = self.path_on_disk(&existing.folder).join(&existing.name);
            add_hard_link(entry, &existing, &disk_path)?;
        }
        Ok(())
    }

    /// Devices, pipes and sockets are left out, because they could not be opened in the sandbox. Whiteouts in the
    /// format of overlayfs are refused, because layers saved by container engines do not contain them.
    fn add_special(&mut self, entry: &str, special: Special) -> Result<(), BundleError> {
        let Some(location) = self.location_for(entry)? else {
            return Ok(());
        };
        let top = location.folder.first().unwrap_or(&location.name);
        if special == Special::OverlayfsWhiteout && !SANDBOX_FOLDERS.contains(&top.as_str()) {
            return Err(invalid_entry(
                entry,
                "is a whiteout of overlayfs (a device 0/0), which layers do not have: expected \
                 what `docker save` writes",
            ));
        }
        self.put(entry, &location, Kind::Special)?;
        Ok(())
    }
}

/// The parts of a path, the last one first.
fn reversed_parts(path: &str) -> Vec<String> {
    let part = |part: &str| (!matches!(part, "" | ".")).then(|| part.to_owned());
    path.rsplit('/').filter_map(part).collect()
}

/// Creates the subfolders of `folder` that do not exist on the disk yet.
fn make_folders(folder: &mut Folder, dir: &Path, budget: &Budget<'_>) -> Result<(), BundleError> {
    for (name, node) in &mut folder.children {
        if let Kind::Folder(folder) = &mut node.kind {
            let dir = dir.join(name);
            if !folder.is_created {
                budget.check()?;
                make_folder(&dir)?;
                folder.is_created = true;
            }
            make_folders(folder, &dir, budget)?;
        }
    }
    Ok(())
}

/// Completes a folder: nothing in it changes afterwards.
fn make_links_and_set_times(
    folder: &Folder,
    disk_path: &Path,
    budget: &Budget<'_>,
) -> Result<(), BundleError> {
    for (name, node) in &folder.children {
        let disk_path = disk_path.join(name);
        match &node.kind {
            Kind::Folder(folder) => make_links_and_set_times(folder, &disk_path, budget)?,
            Kind::File | Kind::Special => {}
            Kind::Link(target) => {
                symlink(target, &disk_path)?;
                set_default_time(&disk_path)?;
            }
        }
    }
    budget.check()?;
    set_default_time(disk_path)
}
