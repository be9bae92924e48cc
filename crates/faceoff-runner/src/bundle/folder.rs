use super::{error::BundleError, tree::Tree};
use fs_err::{self as fs, File};
use std::{
    os::unix::fs::{MetadataExt, PermissionsExt},
    path::Path,
};

/// Brings everything below `folder` into the tree, in order of the names.
pub(super) fn copy(folder: &Path, tree: &mut Tree<'_>) -> Result<(), BundleError> {
    let place = fs::metadata(tree.place_on_disk())?;
    copy_below(folder, "", (place.dev(), place.ino()), tree)
}

/// Folders are entered up to the longest path that a tree accepts, so recursion is bounded.
///
/// `copy` identifies the folder that is being filled: it may lie inside of the source.
fn copy_below(
    folder: &Path,
    prefix: &str,
    copy: (u64, u64),
    tree: &mut Tree<'_>,
) -> Result<(), BundleError> {
    let mut entries = fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let name = entry.file_name().into_string().map_err(|name| {
            BundleError::Invalid(format!("the bundle has a name that is not UTF-8: {name:?}"))
        })?;
        let name = format!("{prefix}{name}");
        let metadata = entry.metadata()?;
        let (kind, mode) = (metadata.file_type(), metadata.permissions().mode());
        if kind.is_dir() {
            if (metadata.dev(), metadata.ino()) == copy {
                continue;
            }
            tree.folder(&name, mode)?;
            copy_below(&path, &format!("{name}/"), copy, tree)?;
        } else if kind.is_file() {
            tree.file(&name, mode, &mut File::open(&path)?.into_file())?;
        } else if kind.is_symlink() {
            let target = fs::read_link(&path)?;
            let target = target.to_str().ok_or_else(|| {
                BundleError::Invalid(format!(
                    "entry {name:?} is a link to a name that is not UTF-8"
                ))
            })?;
            tree.link(&name, target)?;
        } else {
            return Err(tree.refuse(&name, "a device, pipe or socket"));
        }
    }
    Ok(())
}
