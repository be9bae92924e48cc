use serde::{Deserialize, Serialize};

/// What a bundle may hold (PROTOCOL, "Bundle").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BundleLimits {
    /// Largest archive, in bytes.
    pub packed_bytes: u64,
    /// Largest sum of its files, in bytes.
    pub unpacked_bytes: u64,
    /// Most files and links; folders are counted separately, against the same number.
    pub files: u64,
}

impl Default for BundleLimits {
    fn default() -> Self {
        Self {
            packed_bytes: 512 << 20,
            unpacked_bytes: 2 << 30,
            files: 50_000,
        }
    }
}
