/// The node in the tree that an entry of the archive becomes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Node {
    Folder {
        /// The archive has an entry for the folder itself, not only for something inside.
        named: bool,
        /// It exists on the disk: a folder is created when something is put into it, or at the end.
        is_created: bool,
    },
    File,
    Link {
        target: String,
    },
}
