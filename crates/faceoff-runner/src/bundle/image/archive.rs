use super::{
    digest::{Digest, Hashed},
    words::invalid,
};
use crate::bundle::{
    budget::{Budget, Watched},
    error::BundleError,
    node::Node,
};
use faceoff_types::harmless;
use fs_err::{self as fs, File};
use serde::de::DeserializeOwned;
use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Read},
    path::{Path, PathBuf},
};

/// What `docker save` writes.
pub(super) const DOCKER_LIST: &str = "manifest.json";
/// What the layout of the Open Container Initiative begins with.
pub(super) const OCI_INDEX: &str = "index.json";
const OCI_MARK: &str = "oci-layout";
/// Largest JSON document, in bytes; those of ordinary images have some kilobytes.
const DOCUMENT_MAX_BYTES: u64 = 1 << 20;
/// How many documents may be read: lists can name lists.
const MOST_DOCUMENTS: u32 = 64;
/// As many links as Linux follows on one path.
const MOST_LINKS: usize = 40;

/// The files of an unpacked archive that may be an image. As everywhere, what is there is known from memory;
/// of its links none is on the disk, and of its folders those that hold a file.
pub(in crate::bundle) struct Archive<'a> {
    into: PathBuf,
    nodes: BTreeMap<String, Node>,
    budget: &'a Budget<'a>,
    documents: u32,
    /// Whose digests have been compared.
    verified: BTreeSet<Digest>,
}

impl<'a> Archive<'a> {
    /// The files in the folder `into`. What was packed with the folder around it is taken from there.
    pub(in crate::bundle) fn new(
        into: PathBuf,
        nodes: BTreeMap<String, Node>,
        budget: &'a Budget<'a>,
    ) -> Self {
        let (into, nodes) = match only_folder(&nodes) {
            Some(folder) => {
                let inside = nodes.iter().filter_map(|(path, node)| {
                    let path = path.strip_prefix(&folder)?.strip_prefix('/')?;
                    Some((path.to_owned(), node.clone()))
                });
                (into.join(&folder), inside.collect())
            }
            None => (into, nodes),
        };
        Self {
            into,
            nodes,
            budget,
            documents: 0,
            verified: BTreeSet::new(),
        }
    }

    /// Does it hold what makes an archive an image?
    pub(in crate::bundle) fn is_image(&self) -> bool {
        self.has(DOCKER_LIST) || self.is_layout()
    }

    /// Does it hold the Open Container Initiative's layout?
    pub(super) fn is_layout(&self) -> bool {
        self.has(OCI_MARK) && self.has(OCI_INDEX)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.nodes.get(name) == Some(&Node::File)
    }

    /// The file that `name` leads to. Links inside of the archive are followed in memory: earlier versions of
    /// Docker write one where two layers are the same.
    pub(super) fn real_name(&self, name: &str) -> Result<String, BundleError> {
        let mut at = name.to_owned();
        for _ in 0..MOST_LINKS {
            match self.nodes.get(&at) {
                Some(Node::File) => return Ok(at),
                Some(Node::Link { target }) => match join(&at, target) {
                    Some(next) => at = next,
                    None => break,
                },
                _ => break,
            }
        }
        let shown: String = name.chars().take(200).collect();
        // Engines write what they have, and some do not have all of an image.
        let help = match Digest::of_blob(name) {
            Some(_) => ": pull or build the image again, and save it anew",
            None => "",
        };
        Err(invalid(format_args!(
            "names {shown:?}, which is no file of the archive{help}"
        )))
    }

    fn place(&self, name: &str) -> Result<PathBuf, BundleError> {
        Ok(self.into.join(self.real_name(name)?))
    }

    /// Opens the file `name`. What is read of it counts, since an image may name it as often as it likes.
    pub(super) fn open(&self, name: &str) -> Result<Blob<'a>, BundleError> {
        let place = self.place(name)?;
        Ok(Blob {
            inner: self.watched(&place)?,
            budget: self.budget,
        })
    }

    /// Reads the file `name`, once, if it is named by its digest: it must have it.
    pub(super) fn verify(&mut self, name: &str) -> Result<(), BundleError> {
        let Some(digest) = Digest::of_blob(name) else {
            return Ok(());
        };
        if self.verified.contains(&digest) {
            return Ok(());
        }
        let mut hashed = Hashed::new(self.watched(&self.place(name)?)?);
        io::copy(&mut hashed, &mut io::sink()).map_err(BundleError::reading(name))?;
        digest.check(name, hashed.into_hash())?;
        self.verified.insert(digest);
        Ok(())
    }

    fn watched(&self, place: &Path) -> Result<Watched<'a, std::fs::File>, BundleError> {
        Ok(Watched::new(File::open(place)?.into_file(), self.budget))
    }

    /// Reads a JSON document.
    pub(super) fn document<T: DeserializeOwned>(&mut self, name: &str) -> Result<T, BundleError> {
        self.documents += 1;
        if self.documents > MOST_DOCUMENTS {
            return Err(invalid(format_args!(
                "is described by more than {MOST_DOCUMENTS} documents"
            )));
        }
        let bytes_of = |place: &Path| Ok::<_, BundleError>(fs::symlink_metadata(place)?.len());
        if bytes_of(&self.place(name)?)? > DOCUMENT_MAX_BYTES {
            return Err(invalid(format_args!(
                "has the document {name:?} of more than {DOCUMENT_MAX_BYTES} bytes"
            )));
        }
        self.verify(name)?;
        let mut bytes = Vec::new();
        self.open(name)?
            .take(DOCUMENT_MAX_BYTES)
            .read_to_end(&mut bytes)
            .map_err(BundleError::reading(name))?;
        serde_json::from_slice(&bytes).map_err(|error| {
            // It may quote the text.
            let told = error.to_string();
            invalid(format_args!("cannot be read: {name}: {}", harmless(&told)))
        })
    }

    /// Where nothing of the archive is.
    pub(super) fn free_place(&self) -> PathBuf {
        let mut names = (0_u64..).map(|number| format!("root{number}"));
        let free = names.find(|name| !self.nodes.contains_key(name));
        self.into.join(free.unwrap_or_default())
    }

    /// Removes a file that is not needed any more.
    pub(super) fn remove(&mut self, name: &str) -> Result<(), BundleError> {
        if self.nodes.remove(name) == Some(Node::File) {
            fs::remove_file(self.into.join(name))?;
        }
        Ok(())
    }

    /// Removes all that is left.
    pub(super) fn clear(self) -> Result<(), BundleError> {
        for top in self.tops() {
            let place = self.into.join(top);
            match self.nodes.get(top) {
                Some(Node::Folder { is_made: true, .. }) => fs::remove_dir_all(place)?,
                Some(Node::File) => fs::remove_file(place)?,
                Some(Node::Folder { .. } | Node::Link { .. }) | None => {}
            }
        }
        Ok(())
    }

    fn tops(&self) -> impl Iterator<Item = &str> {
        let names = self.nodes.keys().map(String::as_str);
        names.filter(|name| !name.contains('/'))
    }
}

/// The single folder at the top, if there is nothing beside it.
fn only_folder(nodes: &BTreeMap<String, Node>) -> Option<String> {
    let mut tops = nodes.iter().filter(|(path, _)| !path.contains('/'));
    match (tops.next(), tops.next()) {
        (Some((folder, Node::Folder { .. })), None) => Some(folder.clone()),
        _ => None,
    }
}

/// A file of the archive that is read as a part of an image.
pub(super) struct Blob<'a> {
    inner: Watched<'a, std::fs::File>,
    budget: &'a Budget<'a>,
}

impl Read for Blob<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.budget.of_image(read)?;
        Ok(read)
    }
}

/// The path to which a link at `from` leads, if that is inside of the archive.
fn join(from: &str, target: &str) -> Option<String> {
    if target.starts_with('/') {
        return None;
    }
    let mut at: Vec<&str> = from.split('/').collect();
    at.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(at.pop()?),
            part => at.push(part),
        }
    }
    Some(at.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_of_the_archive_stay_inside() {
        assert_eq!(
            join("a/layer.tar", "../b/layer.tar").as_deref(),
            Some("b/layer.tar")
        );
        assert_eq!(join("a/x", "./y").as_deref(), Some("a/y"));
        assert_eq!(join("a/x", "../../y"), None);
        assert_eq!(join("a/x", "/etc/passwd"), None);
    }
}
