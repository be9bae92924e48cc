//! A season that stands still: what is refused of it, and how pages and answers say so.

use crate::{
    app::{App, AppState},
    pages,
    problem::{Problem, ProblemKind},
};
use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};

/// Answers whatever would change something, whoever asks, where the season is an archive's.
pub(crate) async fn refuse_changes(
    State(app): State<App>,
    request: Request,
    next: Next,
) -> Response {
    match app.store.archived() {
        // What somebody wants to see is no change of the season.
        Some(archived)
            if !request.method().is_safe() && request.uri().path() != pages::SPOILERS_PATH =>
        {
            let problem = Problem::archived(archived.made_at, archived.imported_at);
            pages::for_whom(request.uri().path(), request.headers(), problem)
        }
        _ => next.run(request).await,
    }
}

/// Refuses an artifact that the archive was made without; `what` it is, in a word.
///
/// # Errors
/// `Gone`.
pub(crate) async fn check_kept(app: &AppState, key: &str, what: &str) -> Result<(), Problem> {
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
pub(crate) async fn is_left_out(app: &AppState, key: &str) -> Result<bool, Problem> {
    // The public edition names no submission's file at all.
    Ok(app.store.archived().is_some()
        && (key.is_empty() || app.store.artifacts().bytes_of(key).await?.is_none()))
}
