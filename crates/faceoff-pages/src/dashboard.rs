//! `/dashboard`: the team dashboard, the signed-in pages of a team: submissions, questions, members and tokens.

pub(super) mod access;
mod evaluations;
mod games;
mod last_result;
mod overview;
mod questions;
pub(super) mod settings;
mod submission;
mod upload;

use axum::{
    Router,
    extract::OriginalUri,
    response::Redirect,
    routing::{any, get, post},
};
use faceoff_service::app::App;

/// Prefix of all paths of the dashboard.
const BASE_PATH: &str = "/dashboard";

/// The prefix in older versions.
const OLD_BASE_PATH: &str = "/desk";

/// All pages of the dashboard except the upload, which has its own timeouts.
pub(super) fn router() -> Router<App> {
    Router::new()
        .route("/dashboard", get(overview::page))
        .route("/dashboard/submissions/{id}", get(submission::page))
        .route(
            "/dashboard/submissions/{id}/activate",
            post(submission::activate),
        )
        .route(
            "/dashboard/submissions/{id}/withdraw",
            post(submission::withdraw),
        )
        .route(
            "/dashboard/submissions/{id}/describe",
            post(submission::describe),
        )
        .route("/dashboard/terms", post(overview::accept_terms))
        .route(
            "/dashboard/questions",
            get(questions::page).post(questions::ask),
        )
        .merge(settings::router(BASE_PATH))
        .merge(settings::team_router())
        .merge(access::router(BASE_PATH))
        .route(OLD_BASE_PATH, any(redirect_old_path))
        .route("/desk/{*rest}", any(redirect_old_path))
}

/// The upload of a bundle.
pub(super) fn uploads() -> Router<App> {
    Router::new().route("/dashboard/upload", post(upload::submit))
}

/// Redirects from the paths of older versions. The query is kept, and so are the method and the body of a form.
async fn redirect_old_path(OriginalUri(uri): OriginalUri) -> Redirect {
    let path_and_query = uri.path_and_query().map_or("", |path| path.as_str());
    let rest = path_and_query
        .strip_prefix(OLD_BASE_PATH)
        .unwrap_or_default();
    Redirect::permanent(&format!("{BASE_PATH}{rest}"))
}
