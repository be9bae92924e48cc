use super::error::BundleError;
use std::io::Read;

/// What an archive's entries become.
pub(super) trait Sink {
    fn folder(&mut self, entry: &str, mode: u32) -> Result<(), BundleError>;
    /// A file, its content streamed.
    fn file(&mut self, entry: &str, mode: u32, content: &mut dyn Read) -> Result<(), BundleError>;
    fn link(&mut self, entry: &str, target: &str) -> Result<(), BundleError>;
    /// Another name of a file.
    fn hard_link(&mut self, entry: &str, target: &str) -> Result<(), BundleError>;
    /// What is none of these.
    fn special(&mut self, entry: &str, special: Special) -> Result<(), BundleError>;
}

/// What has no content.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Special {
    /// The device 0/0, which overlayfs has for what it hides.
    NullDevice,
    Device,
    Pipe,
}
