//! Uploads in parts.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A bundle of which the first bytes have arrived.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct PartialUploadView {
    /// BLAKE3 hash of the whole bundle, 64 hexadecimal digits.
    pub blake3: String,
    /// Number of bytes that have arrived: the next part begins there.
    pub received_bytes: u64,
}
