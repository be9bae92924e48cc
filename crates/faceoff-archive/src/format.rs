//! The version number of the archive format.

/// The archive format that this program writes, and the newest that it reads.
pub const FORMAT: u32 = 1;
