//! The unpacked archive of a container image: its JSON documents, and its layers as packed files. There are two formats: the one of
//! `docker save`, and the *OCI layout* of the Open Container Initiative.

use super::{
    digest::{Digest, HashingReader},
    messages::invalid,
};
use crate::bundle::{
    budget::{Budget, CancellableReader},
    error::BundleError,
    node::Node,
};
use faceoff_types::escape_unprintable;
use fs_err::{self as fs, File};
use serde::de::DeserializeOwned;
use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Read},
    path::{Path, PathBuf},
};

/// Index file of `docker save`.
pub(super) const DOCKER_LIST: &str = "manifest.json";
/// Index file of an OCI layout.
pub(super) const OCI_INDEX: &str = "index.json";
/// File that marks an OCI layout.
const OCI_LAYOUT_FILE: &str = "oci-layout";
/// Largest JSON document, in bytes; the documents of ordinary images have a few kilobytes.
const DOCUMENT_MAX_BYTES: u64 = 1 << 20;
/// Maximum number of read documents, because lists can contain lists.
const MAX_DOCUMENTS: u32 = 64;
/// As many links as Linux follows on one path.
const MAX_LINKS: usize = 40;

/// The files of an unpacked archive that may be an image. Its content is known from memory. The disk has no links, and only those
/// folders that contain a file.
pub(in crate::bundle) struct Archive<'a> {
    dir: PathBuf,
    nodes: BTreeMap<String, Node>,
    budget: &'a Budget<'a>,
    /// Number of documents read so far.
    documents: u32,
    /// Digests of the blobs that have been verified.
    verified: BTreeSet<Digest>,
}

impl<'a> Archive<'a> {
    /// The files in the folder `dir`. If they are all inside a single top-level folder, that folder is used.
    pub(in crate::bundle) fn new(
        dir: PathBuf,
        nodes: BTreeMap<String, Node>,
        budget: &'a Budget<'a>,
    ) -> Self {
        let (dir, nodes) = match single_top_folder(&nodes) {
            Some(folder) => {
                let inside = nodes.iter().filter_map(|(path, node)| {
                    let path = path.strip_prefix(&folder)?.strip_prefix('/')?;
                    Some((path.to_owned(), node.clone()))
                });
                (dir.join(&folder), inside.collect())
            }
            None => (dir, nodes),
        };
        Self {
            dir,
            nodes,
            budget,
            documents: 0,
            verified: BTreeSet::new(),
        }
    }

    /// Does the archive have the index file of an image?
    pub(in crate::bundle) fn is_image(&self) -> bool {
        self.has_file(DOCKER_LIST) || self.is_layout()
    }

    /// Does the archive have an OCI layout?
    pub(super) fn is_layout(&self) -> bool {
        self.has_file(OCI_LAYOUT_FILE) && self.has_file(OCI_INDEX)
    }

    pub(super) fn has_file(&self, name: &str) -> bool {
        self.nodes.get(name) == Some(&Node::File)
    }

    /// The file to which `name` leads. Links inside of the archive are followed in memory: earlier versions of Docker
    /// write a link for a layer that is the same as another.
    pub(super) fn resolve_name(&self, name: &str) -> Result<String, BundleError> {
        let mut path = name.to_owned();
        for _ in 0..MAX_LINKS {
            match self.nodes.get(&path) {
                Some(Node::File) => return Ok(path),
                Some(Node::Link { target }) => match join(&path, target) {
                    Some(next) => path = next,
                    None => break,
                },
                _ => break,
            }
        }
        let shown: String = name.chars().take(200).collect();
        // Some container engines do not have all layers of an image, and save the ones that they have.
        let hint = match Digest::from_blob_path(name) {
            Some(_) => ": pull or build the image again, and save it again",
            None => "",
        };
        Err(invalid(format_args!(
            "names {shown:?}, which is no file of the archive{hint}"
        )))
    }

    fn path(&self, name: &str) -> Result<PathBuf, BundleError> {
        Ok(self.dir.join(self.resolve_name(name)?))
    }

    /// Opens the file `name`. Its bytes are counted, because an image may name the same file many times.
    pub(super) fn open(&self, name: &str) -> Result<Blob<'a>, BundleError> {
        let path = self.path(name)?;
        Ok(Blob {
            inner: self.reader(&path)?,
            budget: self.budget,
        })
    }

    /// Checks the digest of the file `name`, once, if its name contains a digest.
    pub(super) fn verify(&mut self, name: &str) -> Result<(), BundleError> {
        let Some(digest) = Digest::from_blob_path(name) else {
            return Ok(());
        };
        if self.verified.contains(&digest) {
            return Ok(());
        }
        let mut hashed = HashingReader::new(self.reader(&self.path(name)?)?);
        io::copy(&mut hashed, &mut io::sink()).map_err(BundleError::from_read_error(name))?;
        digest.check(name, hashed.into_hash())?;
        self.verified.insert(digest);
        Ok(())
    }

    fn reader(&self, path: &Path) -> Result<CancellableReader<'a, std::fs::File>, BundleError> {
        Ok(CancellableReader::new(
            File::open(path)?.into_file(),
            self.budget,
        ))
    }

    /// Reads a JSON document.
    pub(super) fn document<T: DeserializeOwned>(&mut self, name: &str) -> Result<T, BundleError> {
        self.documents += 1;
        if self.documents > MAX_DOCUMENTS {
            return Err(invalid(format_args!(
                "is described by more than {MAX_DOCUMENTS} documents"
            )));
        }
        let size = fs::symlink_metadata(self.path(name)?)?.len();
        if size > DOCUMENT_MAX_BYTES {
            return Err(invalid(format_args!(
                "has the document {name:?} of more than {DOCUMENT_MAX_BYTES} bytes"
            )));
        }
        self.verify(name)?;
        let mut bytes = Vec::new();
        self.open(name)?
            .take(DOCUMENT_MAX_BYTES)
            .read_to_end(&mut bytes)
            .map_err(BundleError::from_read_error(name))?;
        serde_json::from_slice(&bytes).map_err(|error| {
            // The message may quote unprintable characters of the document.
            let message = error.to_string();
            invalid(format_args!(
                "cannot be read: {name}: {}",
                escape_unprintable(&message)
            ))
        })
    }

    /// A path that the archive does not use.
    pub(super) fn unused_path(&self) -> PathBuf {
        let mut names = (0_u64..).map(|number| format!("root{number}"));
        let unused = names.find(|name| !self.nodes.contains_key(name));
        self.dir.join(unused.unwrap_or_default())
    }

    /// Removes a file that is no longer needed.
    pub(super) fn remove(&mut self, name: &str) -> Result<(), BundleError> {
        if self.nodes.remove(name) == Some(Node::File) {
            fs::remove_file(self.dir.join(name))?;
        }
        Ok(())
    }

    /// Removes all remaining files.
    pub(super) fn remove_rest(self) -> Result<(), BundleError> {
        for top in self.top_level_names() {
            let path = self.dir.join(top);
            match self.nodes.get(top) {
                Some(Node::Folder {
                    is_created: true, ..
                }) => fs::remove_dir_all(path)?,
                Some(Node::File) => fs::remove_file(path)?,
                Some(Node::Folder { .. } | Node::Link { .. }) | None => {}
            }
        }
        Ok(())
    }

    fn top_level_names(&self) -> impl Iterator<Item = &str> {
        let names = self.nodes.keys().map(String::as_str);
        names.filter(|name| !name.contains('/'))
    }
}

/// The single top-level folder, if the archive has no other top-level entry.
fn single_top_folder(nodes: &BTreeMap<String, Node>) -> Option<String> {
    let mut top_level_names = nodes.iter().filter(|(path, _)| !path.contains('/'));
    match (top_level_names.next(), top_level_names.next()) {
        (Some((folder, Node::Folder { .. })), None) => Some(folder.clone()),
        _ => None,
    }
}

/// Reader of a file that is part of an image; counts its bytes.
pub(super) struct Blob<'a> {
    inner: CancellableReader<'a, std::fs::File>,
    budget: &'a Budget<'a>,
}

impl Read for Blob<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.budget.count_image_bytes(read)?;
        Ok(read)
    }
}

/// The path to which the link at `link_path` leads; `None` if it is outside of the archive.
fn join(link_path: &str, target: &str) -> Option<String> {
    if target.starts_with('/') {
        return None;
    }
    let mut parts: Vec<&str> = link_path.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn archive_links_stay_inside() {
        assert_eq!(
            join("a/layer.tar", "../b/layer.tar").as_deref(),
            Some("b/layer.tar")
        );
        assert_eq!(join("a/x", "./y").as_deref(), Some("a/y"));
        assert_eq!(join("a/x", "../../y"), None);
        assert_eq!(join("a/x", "/etc/passwd"), None);
    }
}
