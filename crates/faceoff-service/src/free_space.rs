//! Refusal of requests while the server's disk has too little free space or is full.

use crate::{
    app::AppState,
    problem::{Problem, ProblemKind},
};
use std::io;

/// Refuses a request that needs disk space while too little is free.
///
/// # Errors
/// `StorageFull`.
pub fn check(app: &AppState) -> Result<(), Problem> {
    if app.store.free_space().is_short() {
        return Err(Problem::new(
            ProblemKind::StorageFull,
            "the server's disk has too little free space, so uploads are refused and the queue pauses until there is \
             more; nothing was stored. Your request is fine: try again later",
        ));
    }
    Ok(())
}

/// The problem of a file that the server could not write.
pub fn write_problem(error: io::Error) -> Problem {
    if faceoff_types::is_full_disk(&error) {
        tracing::warn!(%error, "the disk is full");
        Problem::new(
            ProblemKind::StorageFull,
            "the server's disk is full; nothing was stored. Your request is fine: try again later",
        )
    } else {
        Problem::internal(error)
    }
}
