//! Which artifacts an imported season archive contains.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};

/// Refuses an artifact that the archive does not contain; `what` names its kind.
///
/// # Errors
/// `Gone`.
#[boxed]
pub async fn check_included(app: &AppState, key: &str, what: &str) -> Result<(), Problem> {
    if is_omitted(app, key).await? {
        return Err(Problem::new(
            ProblemKind::Gone,
            format!(
                "the archive that this server shows does not contain this {what}; the organiser's archive may"
            ),
        ));
    }
    Ok(())
}

/// Whether an artifact is missing because the archive does not contain it.
#[boxed]
pub async fn is_omitted(app: &AppState, key: &str) -> Result<bool, Problem> {
    // The public edition names no submission's file at all.
    Ok(app.store.archived_season().is_some()
        && (key.is_empty() || app.store.artifacts().size_bytes(key).await?.is_none()))
}
