/// What an entry of the archive became.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Node {
    Folder {
        /// The archive has an entry for it, not only for something inside.
        named: bool,
        /// It is on the disk: a folder is made when something is put into it, or at the end.
        is_made: bool,
    },
    File,
    Link {
        target: String,
    },
}
