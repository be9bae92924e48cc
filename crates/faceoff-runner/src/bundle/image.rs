//! A bundle that is a container image: its layers, merged, are all that its agent sees.

mod archive;
mod digest;
mod documents;
mod env;
mod layer;
mod root;
mod words;

pub(super) use archive::Archive;

use super::{budget::Budget, error::BundleError};
use documents::Parts;
use root::Root;
use std::{collections::BTreeMap, path::PathBuf};

/// Which programs are found by their names alone, if the image does not say: as container engines have it.
const USUAL_PATH: &str = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin";

/// What an image brings beside its `/agent`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// The merged layers. Its symbolic links may lead anywhere: nothing of the host's may follow one.
    pub root: PathBuf,
    /// The variables of its `ENV`.
    pub env: BTreeMap<String, String>,
}

impl Image {
    /// Where its programs are looked for.
    #[must_use]
    pub fn path(&self) -> &str {
        self.env.get("PATH").map_or(USUAL_PATH, String::as_str)
    }
}

/// Merges the layers of the image in `archive` in a folder beside its files, which go: each layer's when it
/// has been applied, all others then.
///
/// What a layer's file came packed as and what comes of it are on the disk at once, so each has the limit of
/// the unpacked bytes for itself: an image takes at most twice that limit while it is unpacked, and once at
/// the end. Entries, streams and time are counted over all of it.
pub(super) fn unpack<'a>(
    mut archive: Archive<'a>,
    manifest: &str,
    budget: &'a Budget<'a>,
) -> Result<(Image, PathBuf), BundleError> {
    let Parts { env, mut layers } = documents::read(&mut archive)?;
    let place = archive.free_place();
    budget.begin_root();
    let mut root = Root::new(&place, budget)?;
    let count = layers.len();
    for (index, part) in layers.iter_mut().enumerate() {
        part.name = archive
            .real_name(&part.name)
            .map_err(|error| part.in_it(error, index + 1, count))?;
    }
    for (index, part) in layers.iter().enumerate() {
        let is_needed_again = layers[index + 1..]
            .iter()
            .any(|later| later.name == part.name);
        root.begin_layer();
        // What the budget ended is told by it, and so with the layer.
        let applied = budget.verdict(layer::apply(&mut archive, part, &mut root, budget));
        applied.map_err(|error| part.in_it(error, index + 1, count))?;
        if !is_needed_again {
            archive.remove(&part.name)?;
        }
    }
    archive.clear()?;
    let agent = root.finish(manifest)?;
    Ok((Image { root: place, env }, agent))
}
