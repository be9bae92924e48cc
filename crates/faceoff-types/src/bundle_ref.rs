use serde::{Deserialize, Serialize};

/// Where an uploaded bundle is kept and what it must be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BundleRef {
    /// Where the archive is among the artifacts.
    pub key: String,
    /// Size of the archive.
    pub bytes: u64,
    /// BLAKE3 of the archive, 64 hexadecimal digits.
    pub blake3: String,
    /// As the team named it.
    pub file_name: String,
}
