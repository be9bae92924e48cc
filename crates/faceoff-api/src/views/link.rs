//! Signed links, which download a file without a token.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A new download link, which is shown only once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LinkView {
    /// A URL, or a path if the server's public URL is not configured.
    pub url: String,
    /// When the link expires.
    pub expires_at: Timestamp,
}
