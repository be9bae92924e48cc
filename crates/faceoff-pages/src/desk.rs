//! `/desk`: what a team does. Uploading, choosing what plays, and who may do so.

pub(super) mod access;
mod agents;
mod evaluations;
mod questions;
mod submission;
mod upload;

use axum::{
    Router,
    routing::{get, post},
};
use faceoff_service::app::App;

/// All pages of the desk but the upload, which takes its time.
pub(super) fn router() -> Router<App> {
    Router::new()
        .route("/desk", get(agents::page))
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
        .route("/desk/terms", post(agents::accept_terms))
        .route("/desk/questions", get(questions::page).post(questions::ask))
        .merge(access::router("/desk"))
}

/// Where an agent is uploaded.
pub(super) fn uploads() -> Router<App> {
    Router::new().route("/desk/upload", post(upload::submit))
}
