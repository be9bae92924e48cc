//! The season archive that a server shows. An *archive* is an export of a whole season; a server that has imported one shows it
//! read-only.

use faceoff_api::views::archive::ArchiveView;
use faceoff_store::ArchivedSeason;

pub fn view(archived: &ArchivedSeason) -> ArchiveView {
    ArchiveView {
        made_at: archived.made_at,
        imported_at: archived.imported_at,
        edition: archived.edition.to_string(),
        program: archived.program.clone(),
    }
}
