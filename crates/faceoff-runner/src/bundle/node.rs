/// What an entry of the archive became.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Node {
    /// A folder; `named` when the archive has an entry for it, not only for something inside.
    Folder {
        named: bool,
    },
    File,
    Link {
        target: String,
    },
}
