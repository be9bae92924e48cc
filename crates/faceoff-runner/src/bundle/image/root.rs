use super::words::{invalid, what_to_write};
use crate::bundle::{
    budget::Budget,
    entry::{
        PATH_MAX_BYTES, check_target, invalid as invalid_entry, make_folder, normalise, write_name,
        write_new,
    },
    error::BundleError,
    sink::{Sink, Special},
};
use fs_err::{self as fs, os::unix::fs::symlink};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    io::Read,
    path::{Path, PathBuf},
};

/// As many links as Linux follows on one path.
const MOST_LINKS: usize = 40;
/// The sandbox's own: empty folders in every image, in which it shows what belongs there. What layers have in them
/// is unpacked and counted as all else, since other names of it may lie elsewhere, and removed at the end.
const SANDBOX_FOLDERS: [&str; 5] = ["dev", "proc", "run", "sys", "tmp"];
/// Files that the sandbox covers, and what there is of the network: nothing but the agent itself.
const SANDBOX_FILES: [(&str, &str); 5] = [
    ("group", ""),
    ("hostname", "agent\n"),
    ("hosts", "127.0.0.1 localhost\n::1 localhost\n"),
    ("passwd", ""),
    ("resolv.conf", ""),
];
/// Where an agent is in its image.
const AGENT: &str = "agent";
/// What a layer calls that which it takes away from those below.
const WHITEOUT: &str = ".wh.";
/// Takes away all that a folder has from layers below.
const OPAQUE: &str = ".wh..wh..opq";
/// Notes of the file system that whiteouts come from; container engines skip them, too.
const WHITEOUT_NOTE: &str = ".wh..wh.";

/// The root that grows while layers are applied. What is in it is known from memory, never asked back from
/// the disk, where there are folders and files only until all layers are applied: symbolic links are followed
/// in memory, as they lead inside of the root, and made last. So nothing of the host's can be reached
/// through one, whatever it says. A folder is made when a file is put into it, or at the end: too many of them are
/// refused before there is one to be made and removed.
pub(super) struct Root<'a> {
    place: PathBuf,
    budget: &'a Budget<'a>,
    top: Folder,
    /// The layer that is being applied, from 1.
    layer: u32,
    /// Ever made, links among them.
    files: u64,
    folders: u64,
}

#[derive(Debug, Default)]
struct Folder {
    children: BTreeMap<String, Node>,
    /// It is on the disk, and so is what leads to it.
    is_made: bool,
}

#[derive(Debug)]
struct Node {
    /// The last one that had an entry for it: whiteouts hide what is of the layers below theirs.
    layer: u32,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Folder(Folder),
    File,
    Link(String),
    /// A device, pipe or socket: only its name is known, and nothing on the disk.
    Special,
}

/// Where something is to be: in a folder of the root, by its parts, none of them a link.
struct Spot {
    folder: Vec<String>,
    name: String,
}

impl Spot {
    fn path(&self) -> String {
        let mut path = self.folder.join("/");
        if !path.is_empty() {
            path.push('/');
        }
        path + &self.name
    }
}

impl Folder {
    fn folder(&self, name: &str) -> Option<&Self> {
        match self.children.get(name).map(|node| &node.kind) {
            Some(Kind::Folder(folder)) => Some(folder),
            _ => None,
        }
    }

    fn at(&self, path: &[String]) -> Option<&Self> {
        path.iter().try_fold(self, |at, name| at.folder(name))
    }

    fn at_mut(&mut self, path: &[String]) -> Option<&mut Self> {
        path.iter()
            .try_fold(self, |at, name| match at.children.get_mut(name) {
                Some(Node {
                    kind: Kind::Folder(folder),
                    ..
                }) => Some(folder),
                _ => None,
            })
    }

    /// Removes what is of layers below `layer`.
    fn hide_all(
        &mut self,
        place: &Path,
        layer: u32,
        budget: &Budget<'_>,
    ) -> Result<(), BundleError> {
        let mut hidden = Ok(());
        self.children.retain(|name, node| {
            hidden.is_err()
                || match node.stays(&place.join(name), layer, budget) {
                    Ok(stays) => stays,
                    Err(error) => {
                        hidden = Err(error);
                        true
                    }
                }
        });
        hidden
    }
}

impl Node {
    /// Removes from the disk what of this is of layers below `layer`; is anything left?
    fn stays(
        &mut self,
        place: &Path,
        layer: u32,
        budget: &Budget<'_>,
    ) -> Result<bool, BundleError> {
        budget.looked_up(place.as_os_str().len())?;
        match &mut self.kind {
            Kind::Folder(folder) => {
                folder.hide_all(place, layer, budget)?;
                let stays = self.layer == layer || !folder.children.is_empty();
                if !stays && folder.is_made {
                    fs::remove_dir(place)?;
                }
                Ok(stays)
            }
            _ if self.layer == layer => Ok(true),
            Kind::File => {
                fs::remove_file(place)?;
                Ok(false)
            }
            Kind::Link(_) | Kind::Special => Ok(false),
        }
    }
}

impl<'a> Root<'a> {
    /// An empty root in a new folder.
    pub(super) fn new(place: &Path, budget: &'a Budget<'a>) -> Result<Self, BundleError> {
        make_folder(place)?;
        Ok(Self {
            place: place.to_owned(),
            budget,
            top: Folder {
                children: BTreeMap::new(),
                is_made: true,
            },
            layer: 0,
            files: 0,
            folders: 0,
        })
    }

    /// What comes from now on is of the next layer.
    pub(super) const fn begin_layer(&mut self) {
        self.layer += 1;
    }

    fn on_disk(&self, folder: &[String]) -> PathBuf {
        self.place.join(folder.join("/"))
    }

    /// Where the parts of a path lead: links are followed inside of the root, whose parent is itself; what is
    /// not there is where it would be made.
    fn resolve(&self, entry: &str, path: &str) -> Result<Vec<String>, BundleError> {
        let mut at: Vec<(String, Option<&Folder>)> = Vec::new();
        // What is still to be walked, the next part last.
        let mut todo: Vec<String> = parts(path);
        let mut links = 0;
        while let Some(part) = todo.pop() {
            self.budget.looked_up(part.len())?;
            if part == ".." {
                at.pop();
                continue;
            }
            let here = at.last().map_or(Some(&self.top), |(_, folder)| *folder);
            match here.and_then(|here| here.children.get(&part)) {
                None => at.push((part, None)),
                Some(node) => match &node.kind {
                    Kind::Folder(folder) => at.push((part, Some(folder))),
                    Kind::File | Kind::Special => {
                        let shown: String = part.chars().take(200).collect();
                        return Err(invalid_entry(
                            entry,
                            format_args!("needs {shown:?} to be a folder, but it is a file"),
                        ));
                    }
                    Kind::Link(target) => {
                        links += 1;
                        if links > MOST_LINKS {
                            return Err(invalid_entry(
                                entry,
                                format_args!("goes through more than {MOST_LINKS} links"),
                            ));
                        }
                        self.budget.looked_up(target.len())?;
                        if target.starts_with('/') {
                            at.clear();
                        }
                        todo.extend(parts(target));
                    }
                },
            }
        }
        let path: Vec<String> = at.into_iter().map(|(part, _)| part).collect();
        if path.iter().map(|part| part.len() + 1).sum::<usize>() > PATH_MAX_BYTES {
            return Err(invalid_entry(
                entry,
                format_args!("leads to too long a path: at most {PATH_MAX_BYTES} bytes"),
            ));
        }
        Ok(path)
    }

    /// Where a path of a layer is: its folders resolved, its last part taken as it is. `None` for the root. Some
    /// builders write paths that begin with a slash, which is the root's.
    fn spot(&self, entry: &str, path: &str) -> Result<Option<Spot>, BundleError> {
        let path = match path.trim_start_matches('/') {
            "" if !path.is_empty() => return Ok(None),
            path => normalise(path)?,
        };
        if path.is_empty() {
            return Ok(None);
        }
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", &path));
        Ok(Some(Spot {
            folder: self.resolve(entry, folder)?,
            name: name.to_owned(),
        }))
    }

    /// Where an entry is to be placed. `None` if there is nothing to place: it is the root, or a whiteout,
    /// which is carried out.
    fn spot_for(&mut self, entry: &str) -> Result<Option<Spot>, BundleError> {
        let Some(spot) = self.spot(entry, entry)? else {
            return Ok(None);
        };
        if let Some(hidden) = spot.name.strip_prefix(WHITEOUT) {
            self.white_out(entry, &spot, hidden)?;
            return Ok(None);
        }
        Ok(Some(spot))
    }

    /// Takes away what layers below have there, wherever in its layer the whiteout stands.
    fn white_out(&mut self, entry: &str, spot: &Spot, hidden: &str) -> Result<(), BundleError> {
        let (layer, budget, place) = (self.layer, self.budget, self.on_disk(&spot.folder));
        let Some(folder) = self.top.at_mut(&spot.folder) else {
            return Ok(());
        };
        if spot.name == OPAQUE {
            return folder.hide_all(&place, layer, budget);
        }
        if spot.name.starts_with(WHITEOUT_NOTE) {
            return Ok(());
        }
        if matches!(hidden, "" | "." | "..") {
            return Err(invalid_entry(entry, "is a whiteout of no possible name"));
        }
        if let Some(node) = folder.children.get_mut(hidden)
            && !node.stays(&place.join(hidden), layer, budget)?
        {
            folder.children.remove(hidden);
        }
        Ok(())
    }

    /// Adds the folders on the way, and clears the spot of what is there.
    fn clear(&mut self, entry: &str, spot: &Spot) -> Result<&mut Folder, BundleError> {
        self.add_folders(&spot.folder)?;
        let place = self.on_disk(&spot.folder).join(&spot.name);
        let folder = self
            .top
            .at_mut(&spot.folder)
            .ok_or_else(|| invalid_entry(entry, "needs a folder that is none"))?;
        match folder.children.remove(&spot.name).map(|node| node.kind) {
            Some(Kind::Folder(there)) if there.is_made => fs::remove_dir_all(place)?,
            Some(Kind::File) => fs::remove_file(place)?,
            Some(Kind::Folder(_) | Kind::Link(_) | Kind::Special) | None => {}
        }
        Ok(folder)
    }

    /// Takes a spot for something that is no folder. Whatever is there goes, as the later entry of an archive
    /// replaces the earlier one; a file is made anew, since other names of the old one keep its content.
    fn put(&mut self, entry: &str, spot: &Spot, kind: Kind) -> Result<PathBuf, BundleError> {
        self.files += 1;
        let most = self.budget.limits().files;
        if self.files > most {
            return Err(invalid(format_args!(
                "has more than {most} files in all layers"
            )));
        }
        let layer = self.layer;
        let is_written = matches!(kind, Kind::File);
        let folder = self.clear(entry, spot)?;
        folder
            .children
            .insert(spot.name.clone(), Node { layer, kind });
        if is_written {
            self.make_way(&spot.folder)?;
        }
        Ok(self.on_disk(&spot.folder).join(&spot.name))
    }

    fn add_folders(&mut self, path: &[String]) -> Result<(), BundleError> {
        let most = self.budget.limits().files;
        let mut at = &mut self.top;
        for name in path {
            let node = match at.children.entry(name.clone()) {
                Entry::Occupied(there) => there.into_mut(),
                Entry::Vacant(free) => {
                    self.folders += 1;
                    if self.folders > most {
                        return Err(invalid(format_args!(
                            "has more than {most} folders in all layers"
                        )));
                    }
                    free.insert(Node {
                        layer: self.layer,
                        kind: Kind::Folder(Folder::default()),
                    })
                }
            };
            at = match &mut node.kind {
                Kind::Folder(folder) => folder,
                Kind::File | Kind::Link(_) | Kind::Special => {
                    return Err(invalid(format_args!("needs {name:?} to be a folder")));
                }
            };
        }
        Ok(())
    }

    /// Makes the folders of a path that are not on the disk yet.
    fn make_way(&mut self, path: &[String]) -> Result<(), BundleError> {
        let (mut at, mut place) = (&mut self.top, self.place.clone());
        for name in path {
            place.push(name);
            let Some(Node {
                kind: Kind::Folder(folder),
                ..
            }) = at.children.get_mut(name)
            else {
                return Err(invalid(format_args!("needs {name:?} to be a folder")));
            };
            if !folder.is_made {
                make_folder(&place)?;
                folder.is_made = true;
            }
            at = folder;
        }
        Ok(())
    }

    /// Completes the root when all layers are applied: what the sandbox needs, the folders that hold no file, and
    /// the links. Returns the agent's folder, which is one, with a file `manifest`: no link leads to either.
    pub(super) fn finish(mut self, manifest: &str) -> Result<PathBuf, BundleError> {
        self.begin_layer();
        let agent = match self.top.children.get(AGENT).map(|node| &node.kind) {
            Some(Kind::Folder(agent)) => agent,
            Some(Kind::File | Kind::Link(_) | Kind::Special) => {
                return Err(invalid(format_args!(
                    "has something else than a folder as /{AGENT}; {}",
                    what_to_write()
                )));
            }
            None => {
                return Err(invalid(format_args!(
                    "has no /{AGENT}; {}",
                    what_to_write()
                )));
            }
        };
        match agent.children.get(manifest).map(|node| &node.kind) {
            Some(Kind::File) => {}
            Some(Kind::Folder(_) | Kind::Link(_) | Kind::Special) => {
                return Err(invalid(format_args!(
                    "has something else than a file as /{AGENT}/{manifest}"
                )));
            }
            None => {
                return Err(invalid(format_args!(
                    "has no /{AGENT}/{manifest}; {}",
                    what_to_write()
                )));
            }
        }
        if let Some(Kind::File | Kind::Link(_) | Kind::Special) =
            self.top.children.get("etc").map(|node| &node.kind)
        {
            return Err(invalid("has something else than a folder as /etc"));
        }
        for (name, content) in SANDBOX_FILES {
            let spot = Spot {
                folder: vec!["etc".to_owned()],
                name: name.to_owned(),
            };
            let place = self.put(name, &spot, Kind::File)?;
            write_new(name, &place, 0o644, &mut content.as_bytes(), self.budget)?;
        }
        for name in SANDBOX_FOLDERS {
            let spot = Spot {
                folder: Vec::new(),
                name: name.to_owned(),
            };
            self.clear(name, &spot)?;
            self.add_folders(&[name.to_owned()])?;
        }
        make_folders(&mut self.top, &self.place, self.budget)?;
        make_links(&self.top, &self.place)?;
        Ok(self.place.join(AGENT))
    }
}

impl Sink for Root<'_> {
    /// A folder that is there stays as it is: all have one mode.
    fn folder(&mut self, entry: &str, _mode: u32) -> Result<(), BundleError> {
        let Some(spot) = self.spot_for(entry)? else {
            return Ok(());
        };
        let layer = self.layer;
        let mut path = spot.folder.clone();
        path.push(spot.name.clone());
        if let Some(parent) = self.top.at_mut(&spot.folder)
            && let Some(node) = parent.children.get_mut(&spot.name)
            && matches!(node.kind, Kind::Folder(_))
        {
            node.layer = layer;
            return Ok(());
        }
        self.clear(entry, &spot)?;
        self.add_folders(&path)
    }

    /// Set-id bits are left out: they would do nothing in the sandbox, and many images have some.
    fn file(&mut self, entry: &str, mode: u32, content: &mut dyn Read) -> Result<(), BundleError> {
        let Some(spot) = self.spot_for(entry)? else {
            return Ok(());
        };
        let place = self.put(entry, &spot, Kind::File)?;
        write_new(entry, &place, mode, content, self.budget)
    }

    /// Made by [`Root::finish`]; it may lead anywhere, for it is followed inside of the sandbox only.
    fn link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let Some(spot) = self.spot_for(entry)? else {
            return Ok(());
        };
        check_target(entry, target)?;
        self.put(entry, &spot, Kind::Link(target.to_owned()))?;
        Ok(())
    }

    /// Another name of a file or link of this layer or one below. The folders of both names are resolved, the
    /// last parts are not followed.
    fn hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError> {
        let Some(spot) = self.spot_for(entry)? else {
            return Ok(());
        };
        let shown: String = target.chars().take(200).collect();
        let no_file = || {
            invalid_entry(
                entry,
                format_args!(
                    "is a hard link to {shown:?}, which is no file of this layer or one below"
                ),
            )
        };
        let existing = self.spot(entry, target)?.ok_or_else(no_file)?;
        let folder = self.top.at(&existing.folder).ok_or_else(no_file)?;
        let kind = match folder.children.get(&existing.name).map(|node| &node.kind) {
            Some(Kind::File) => Kind::File,
            Some(Kind::Link(target)) => Kind::Link(target.clone()),
            Some(Kind::Special) => Kind::Special,
            Some(Kind::Folder(_)) | None => return Err(no_file()),
        };
        // Archivers that are told of a file twice write it so.
        if existing.path() == spot.path() {
            return Ok(());
        }
        // What is at its own place would go first.
        if format!("{}/", existing.path()).starts_with(&format!("{}/", spot.path())) {
            return Err(invalid_entry(
                entry,
                format_args!("is a hard link to what it replaces: {shown:?}"),
            ));
        }
        let is_file = matches!(kind, Kind::File);
        let place = self.put(entry, &spot, kind)?;
        if is_file {
            let existing = self.on_disk(&existing.folder).join(&existing.name);
            write_name(entry, &existing, &place)?;
        }
        Ok(())
    }

    /// Devices, pipes and sockets are left out: in the sandbox none could be opened. What an overlay's own
    /// folder marks as hidden is no part of a layer as engines save it.
    fn special(&mut self, entry: &str, special: Special) -> Result<(), BundleError> {
        let Some(spot) = self.spot_for(entry)? else {
            return Ok(());
        };
        let top = spot.folder.first().unwrap_or(&spot.name);
        if special == Special::NullDevice && !SANDBOX_FOLDERS.contains(&top.as_str()) {
            return Err(invalid_entry(
                entry,
                "is a whiteout of overlayfs (a device 0/0), which layers do not have: expected \
                 what `docker save` writes",
            ));
        }
        self.put(entry, &spot, Kind::Special)?;
        Ok(())
    }
}

/// The parts of a path, last first.
fn parts(path: &str) -> Vec<String> {
    let part = |part: &str| (!matches!(part, "" | ".")).then(|| part.to_owned());
    path.rsplit('/').filter_map(part).collect()
}

/// Makes the folders in `folder` that are not on the disk yet.
fn make_folders(folder: &mut Folder, place: &Path, budget: &Budget<'_>) -> Result<(), BundleError> {
    for (name, node) in &mut folder.children {
        if let Kind::Folder(folder) = &mut node.kind {
            let place = place.join(name);
            if !folder.is_made {
                budget.check()?;
                make_folder(&place)?;
                folder.is_made = true;
            }
            make_folders(folder, &place, budget)?;
        }
    }
    Ok(())
}

fn make_links(folder: &Folder, place: &Path) -> Result<(), BundleError> {
    for (name, node) in &folder.children {
        let place = place.join(name);
        match &node.kind {
            Kind::Folder(folder) => make_links(folder, &place)?,
            Kind::File | Kind::Special => {}
            Kind::Link(target) => symlink(target, place)?,
        }
    }
    Ok(())
}
