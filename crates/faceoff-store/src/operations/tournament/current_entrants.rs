//! The entrants of a tournament: the teams that take part in it.

use crate::{
    error::Result,
    tables::entrants::{self, Entrant},
    write::Tx,
};
use faceoff_types::TournamentId;

/// Entrants that have not left.
pub(super) async fn current_entrants(tx: &mut Tx, id: TournamentId) -> Result<Vec<Entrant>> {
    let mut entrants = entrants::all(tx, id).await?;
    entrants.retain(|entrant| entrant.departure.is_none());
    Ok(entrants)
}
