//! The season archive that a server shows. A season archive is a file with the whole state of a season.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The server shows a season archive; nothing changes any more.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct ArchiveView {
    /// When the archive was made: the season's state at this time.
    pub made_at: Timestamp,
    /// When this server imported it; null inside an archive.
    pub imported_at: Option<Timestamp>,
    /// `public` leaves out what only organisers may see; `organiser` is complete.
    #[schema(example = "public")]
    pub edition: String,
    /// The program and version that made the archive.
    #[schema(example = "faceoff 0.1.0")]
    pub program: String,
}
