//! A season that stands still: what an archive was made without, and how pages and answers say so.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};

/// Refuses an artifact that the archive was made without; `what` it is, in a word.
///
/// # Errors
/// `Gone`.
#[boxed]
pub async fn check_kept(app: &AppState, key: &str, what: &str) -> Result<(), Problem> {
    if is_left_out(app, key).await? {
        return Err(Problem::new(
            ProblemKind::Gone,
            format!(
                "the archive that this server shows was made without this {what}; who has the organiser's may have it"
            ),
        ));
    }
    Ok(())
}

/// Is an artifact not here because the archive has not brought it?
#[boxed]
pub async fn is_left_out(app: &AppState, key: &str) -> Result<bool, Problem> {
    // The public edition names no submission's file at all.
    Ok(app.store.archived().is_some()
        && (key.is_empty() || app.store.artifacts().bytes_of(key).await?.is_none()))
}
