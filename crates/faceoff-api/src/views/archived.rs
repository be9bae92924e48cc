//! An archive's season.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The season stands still: the server shows an archive of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ArchivedView {
    /// The moment that it shows.
    pub made_at: Timestamp,
    /// When this server took it in; null in an archive.
    pub imported_at: Option<Timestamp>,
    /// `public` or `organiser`.
    #[schema(example = "public")]
    pub edition: String,
    /// What made the archive.
    #[schema(example = "faceoff 0.1.0")]
    pub program: String,
}
