//! The archive of a season: a `.tar.zst` with a manifest in front that names every file, its length and its hash.
//!
//! [`Writer`] makes one on the way to wherever it goes and never holds more than a piece of it. [`check`] and
//! [`unpack`] read one without trusting a byte of it: nothing but the files of its manifest, at plain relative paths,
//! as long as they are said to be and with the hashes that they are said to have. What the files mean is not known
//! here; `docs/archive.md` describes it.

mod error;
mod format;
mod manifest;
mod read;
mod write;

pub use error::ArchiveError;
pub use format::FORMAT;
pub use manifest::{Edition, Entry, MANIFEST_NAME, Manifest};
pub use read::{check, unpack};
pub use write::Writer;
