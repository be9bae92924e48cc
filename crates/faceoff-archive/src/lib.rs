//! The archive of a season: a `.tar.zst` whose first file is a manifest with path, length and hash of all other files.
//! It has two editions: one for the public, and one for the organisers, with everything except secrets.
//!
//! [`Writer`] streams an archive and holds only a small part of it in memory. [`check`] and [`unpack`] read untrusted
//! archives: they accept only the files of the manifest, at plain relative paths, with the lengths and hashes of the
//! manifest. The meaning of the files is not defined here but in `docs/archive.md`.

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
