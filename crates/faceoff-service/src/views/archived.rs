//! An archive's season.

use faceoff_api::views::archived::ArchivedView;
use faceoff_store::Archived;

/// When the archive was made, and when it came here.
pub fn of(archived: &Archived) -> ArchivedView {
    ArchivedView {
        made_at: archived.made_at,
        imported_at: archived.imported_at,
        edition: archived.edition.to_string(),
        program: archived.program.clone(),
    }
}
