//! The receiver of an archive's entries: a bundle's tree, or the root of a container image.

use super::error::BundleError;
use std::io::Read;

/// Receives the entries of an archive.
pub(super) trait EntrySink {
    /// A folder. Its mode is not kept.
    fn add_folder(&mut self, entry: &str) -> Result<(), BundleError>;
    /// A file, its content streamed.
    fn add_file(
        &mut self,
        entry: &str,
        attributes: FileAttributes,
        content: &mut dyn Read,
    ) -> Result<(), BundleError>;
    fn add_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError>;
    /// Another name of a file.
    fn add_hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError>;
    /// An entry of any other kind.
    fn add_special(&mut self, entry: &str, special: Special) -> Result<(), BundleError>;
}

/// What an archive says about a file, beside its content.
#[derive(Debug, Clone, Copy)]
pub(super) struct FileAttributes {
    pub mode: u32,
    /// Time of the last change in seconds since 1970, if the archive has one in UTC. Python compares it with those in its compiled files.
    pub modified_s: Option<u32>,
}

/// The kind of an entry that is neither file, folder nor link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Special {
    /// The device 0/0, with which overlayfs marks hidden files.
    OverlayfsWhiteout,
    Device,
    Pipe,
}
