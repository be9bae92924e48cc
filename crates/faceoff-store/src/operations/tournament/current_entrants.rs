//! The teams in a tournament.

use crate::{
    error::Result,
    tables::entrants::{self, Entrant},
    write::Tx,
};
use faceoff_types::TournamentId;

/// Entrants that have not left.
pub(super) async fn current_entrants(tx: &mut Tx, id: TournamentId) -> Result<Vec<Entrant>> {
    let mut all = entrants::all(tx, id).await?;
    all.retain(|entrant| entrant.departure.is_none());
    Ok(all)
}
