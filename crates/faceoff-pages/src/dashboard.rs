//! `/desk`: the team dashboard: submissions, questions, members and tokens.

pub(super) mod access;
mod evaluations;
mod overview;
mod questions;
mod submission;
mod upload;

use axum::{
    Router,
    routing::{get, post},
};
use faceoff_service::app::App;

/// All pages of the dashboard except the upload, which has its own timeouts.
pub(super) fn router() -> Router<App> {
    Router::new()
        .route("/desk", get(overview::page))
        .route("/desk/submissions/{id}", get(submission::page))
        .route(
            "/desk/submissions/{id}/activate",
            post(submission::activate),
        )
        .route(
            "/desk/submissions/{id}/withdraw",
            post(submission::withdraw),
        )
        .route(
            "/desk/submissions/{id}/describe",
            post(submission::describe),
        )
        .route("/desk/terms", post(overview::accept_terms))
        .route("/desk/questions", get(questions::page).post(questions::ask))
        .merge(access::router("/desk"))
}

/// The upload of a bundle.
pub(super) fn uploads() -> Router<App> {
    Router::new().route("/desk/upload", post(upload::submit))
}
