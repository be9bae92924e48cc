use super::{BundleError, tree::Tree};
use std::{
    fs::{self, File},
    os::unix::fs::{MetadataExt, PermissionsExt},
    path::Path,
};

/// Brings everything below `folder` into the tree, in order of the names.
pub(super) fn copy(folder: &Path, tree: &mut Tree) -> Result<(), BundleError> {
    let place = fs::metadata(tree.place_on_disk())
        .map_err(BundleError::io(format!("reading {}", folder.display())))?;
    copy_below(folder, "", (place.dev(), place.ino()), tree)
}

/// Folders are entered up to the longest path that a tree accepts, so recursion is bounded.
///
/// `copy` identifies the folder that is being filled: it may lie inside of the source.
fn copy_below(
    folder: &Path,
    prefix: &str,
    copy: (u64, u64),
    tree: &mut Tree,
) -> Result<(), BundleError> {
    let reading = || BundleError::io(format!("reading {}", folder.display()));
    let mut entries = fs::read_dir(folder)
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(reading())?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let reading = || BundleError::io(format!("reading {}", path.display()));
        let name = entry.file_name().into_string().map_err(|name| {
            BundleError::Invalid(format!("the bundle has a name that is not UTF-8: {name:?}"))
        })?;
        let name = format!("{prefix}{name}");
        let metadata = entry.metadata().map_err(reading())?;
        let (kind, mode) = (metadata.file_type(), metadata.permissions().mode());
        if kind.is_dir() {
            if (metadata.dev(), metadata.ino()) == copy {
                continue;
            }
            tree.folder(&name, mode)?;
            copy_below(&path, &format!("{name}/"), copy, tree)?;
        } else if kind.is_file() {
            tree.file(&name, mode, &mut File::open(&path).map_err(reading())?)?;
        } else if kind.is_symlink() {
            let target = fs::read_link(&path).map_err(reading())?;
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
