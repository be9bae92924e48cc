//! Which artifacts (stored files) an imported season archive contains. An *archive* is an export of a season; a server that has
//! imported one shows it read-only.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
};

/// Refuses an artifact that the archive does not contain; `artifact_kind` names its kind in the message.
///
/// # Errors
/// `Gone`.
#[boxed_future]
pub async fn check_included(app: &AppState, key: &str, artifact_kind: &str) -> Result<(), Problem> {
    if is_omitted(app, key).await? {
        return Err(Problem::new(
            ProblemKind::Gone,
            format!(
                "the archive that this server shows does not contain this {artifact_kind}; the organiser's archive may"
            ),
        ));
    }
    Ok(())
}

/// Whether an artifact is missing because the archive does not contain it.
#[boxed_future]
pub async fn is_omitted(app: &AppState, key: &str) -> Result<bool, Problem> {
    // In the public edition of an archive the keys of all submissions are empty.
    Ok(app.store.archived_season().is_some()
        && (key.is_empty() || app.store.artifacts().size_bytes(key).await?.is_none()))
}
