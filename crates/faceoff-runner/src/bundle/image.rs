//! A bundle that is a container image. An image consists of *layers*, archives that are applied one over another; the agent sees only
//! the merged result.

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
    /// The variables that the image sets (`ENV` in a Dockerfile).
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
    for (index, layer) in layers.iter_mut().enumerate() {
        layer.name = archive
            .resolve_name(&layer.name)
            .map_err(|error| layer.add_layer_to(error, index + 1, count))?;
    }
    for (index, layer) in layers.iter().enumerate() {
        let is_needed_again = layers[index + 1..]
            .iter()
            .any(|later| later.name == layer.name);
        root.begin_layer();
        // Take the budget's own failure here, so that the message names the layer.
        let applied =
            budget.prefer_own_failure(layer::apply(&mut archive, layer, &mut root, budget));
        applied.map_err(|error| layer.add_layer_to(error, index + 1, count))?;
        if !is_needed_again {
            archive.remove(&layer.name)?;
        }
    }
    archive.remove_rest()?;
    let agent = root.finish(manifest)?;
    Ok((
        Image {
            root: root_dir,
            env,
        },
        agent,
    ))
}
