//! A bundle that is a container image: its agent sees only the merged layers.

mod archive;
mod digest;
mod documents;
mod env;
mod layer;
mod messages;
mod root;

pub(super) use archive::Archive;

use super::{budget::Budget, error::BundleError};
use documents::ImageParts;
use root::Root;
use std::{collections::BTreeMap, path::PathBuf};

/// `PATH` of an image that does not set one, as in container engines.
const DEFAULT_PATH: &str = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin";

/// Files and variables of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Folder with the merged layers. Its symbolic links may lead anywhere, so no code on the host may follow one.
    pub root: PathBuf,
    /// The variables of its `ENV`.
    pub env: BTreeMap<String, String>,
}

impl Image {
    /// The image's `PATH`.
    #[must_use]
    pub fn path(&self) -> &str {
        self.env.get("PATH").map_or(DEFAULT_PATH, String::as_str)
    }
}

/// Merges the layers of the image in `archive` into a folder beside the archive's files, and removes these files: each
/// layer after it has been applied, all others at the end.
///
/// A packed layer and its content are on the disk at the same time, so each has its own limit of unpacked bytes: an
/// image takes at most twice that limit while it is unpacked, and once at the end. Entries, streams and time are
/// counted over both.
pub(super) fn unpack<'a>(
    mut archive: Archive<'a>,
    manifest: &str,
    budget: &'a Budget<'a>,
) -> Result<(Image, PathBuf), BundleError> {
    let ImageParts { env, mut layers } = documents::read(&mut archive)?;
    let root_dir = archive.unused_path();
    budget.begin_layers();
    let mut root = Root::new(&root_dir, budget)?;
    let count = layers.len();
    for (index, part) in layers.iter_mut().enumerate() {
        part.name = archive
            .resolve_name(&part.name)
            .map_err(|error| part.in_layer(error, index + 1, count))?;
    }
    for (index, part) in layers.iter().enumerate() {
        let is_needed_again = layers[index + 1..]
            .iter()
            .any(|later| later.name == part.name);
        root.begin_layer();
        // Take the budget's own failure here, so that the message names the layer.
        let applied = budget.own_failure_or(layer::apply(&mut archive, part, &mut root, budget));
        applied.map_err(|error| part.in_layer(error, index + 1, count))?;
        if !is_needed_again {
            archive.remove(&part.name)?;
        }
    }
    archive.clear()?;
    let agent = root.finish(manifest)?;
    Ok((
        Image {
            root: root_dir,
            env,
        },
        agent,
    ))
}
