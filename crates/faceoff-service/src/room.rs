//! What is refused, and shown, while the disk has too little room.

use crate::{
    app::AppState,
    problem::{Problem, ProblemKind},
};
use std::io;

/// Refuses what would take room while there is too little.
///
/// # Errors
/// `StorageFull`.
pub fn check(app: &AppState) -> Result<(), Problem> {
    if app.store.room().is_short() {
        return Err(Problem::new(
            ProblemKind::StorageFull,
            "the server's disk has too little room, so uploads are refused and the queue pauses until \
             there is more; nothing was stored. Nothing is wrong with what you sent: try again later",
        ));
    }
    Ok(())
}

/// A file of ours that could not be written.
pub fn unwritten(error: io::Error) -> Problem {
    if faceoff_types::tells_of_full_disk(&error) {
        tracing::warn!(%error, "the disk is full");
        Problem::new(
            ProblemKind::StorageFull,
            "the server's disk is full; nothing was stored, and nothing is wrong with what you sent: try \
             again later",
        )
    } else {
        Problem::internal(error)
    }
}
