//! A season that stands still: what would change it is refused.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use faceoff_service::{app::App, problem::Problem};

/// Answers whatever would change something, whoever asks, where the season is an archive's.
pub(crate) async fn refuse_changes(
    State(app): State<App>,
    request: Request,
    next: Next,
) -> Response {
    match app.store.archived() {
        // What somebody wants to see is no change of the season.
        Some(archived)
            if !request.method().is_safe()
                && request.uri().path() != faceoff_pages::SPOILERS_PATH =>
        {
            let problem = Problem::archived(archived.made_at, archived.imported_at);
            faceoff_pages::for_whom(request.uri().path(), request.headers(), problem)
        }
        _ => next.run(request).await,
    }
}
