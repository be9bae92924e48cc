//! A reference to a stored bundle: the archive with an agent's files, or the container image, that a team uploaded.

use serde::{Deserialize, Serialize};

/// An uploaded bundle: where it is stored and what it must hash to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BundleRef {
    /// Key of the archive in the artifact store.
    pub key: String,
    /// Size of the archive in bytes.
    pub bytes: u64,
    /// BLAKE3 of the archive, 64 hexadecimal digits.
    pub blake3: String,
    /// File name given by the team.
    pub file_name: String,
}
