//! Links that download a file without a token.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A link that was made, and is shown this once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct LinkView {
    /// What to follow; a path, if the server does not know its own address.
    pub url: String,
    /// From then on it is worth nothing.
    pub expires_at: Timestamp,
}
