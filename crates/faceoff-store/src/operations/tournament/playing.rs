//! Who is in a tournament.

use crate::{
    error::Result,
    tables::entrants::{self, Entrant},
    write::Tx,
};
use faceoff_types::TournamentId;

/// Those that are in a tournament.
pub(super) async fn playing(tx: &mut Tx, id: TournamentId) -> Result<Vec<Entrant>> {
    let mut all = entrants::all(tx, id).await?;
    all.retain(|entrant| entrant.left.is_none());
    Ok(all)
}
