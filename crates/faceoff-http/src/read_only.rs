//! Refuses changes on a server that shows an archived season, which is an imported copy of a finished one.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use faceoff_service::{app::App, problem::Problem};

/// Refuses every request that could change an archived season, whatever its token.
pub(crate) async fn refuse_changes(
    State(app): State<App>,
    request: Request,
    next: Next,
) -> Response {
    match app.store.archived_season() {
        // The choice to hide results changes a cookie, not the season.
        Some(archived)
            if !request.method().is_safe()
                && request.uri().path() != faceoff_pages::SPOILERS_PATH =>
        {
            let problem = Problem::archived(archived.made_at, archived.imported_at);
            faceoff_pages::problem_response(request.uri().path(), request.headers(), problem)
        }
        _ => next.run(request).await,
    }
}
