//! Requests about signed links, which download a file without a token.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A download link to create.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewLink {
    /// How long the link is valid, in seconds: 1 to 604800 (7 days). Default: 3600.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 1, maximum = 604_800)]
    pub expires_in_s: Option<u32>,
}
