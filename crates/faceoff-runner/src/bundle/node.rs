//! A node (file, folder or link) of the tree that an archive unpacks to.

/// The node in the tree that an entry of the archive becomes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Node {
    Folder {
        /// Does the archive have an entry for the folder itself, not only for something inside?
        has_own_entry: bool,
        /// Does it exist on the disk? A folder is created when something is put into it, or at the end.
        is_created: bool,
    },
    File,
    Link {
        target: String,
    },
}
