//! `/dashboard/upload`: a bundle from a form, streamed to disk like uploads through the API.

use super::overview;
use crate::{
    dashboard_frame::{Notice, redirect_done},
    form_file::FormFile,
    frame::PageProblem,
    page_auth::PageMember,
    spoilers::Spoilers,
};
use axum::{body::Body, extract::State, http::HeaderMap, response::Response};
use faceoff_service::{
    app::App,
    problem::{Problem, ProblemKind},
    services::uploads::{BundleSource, IncomingBundle, upload},
    session,
};
use faceoff_store::Submission;

async fn receive_bundle(
    app: &App,
    member: &PageMember,
    headers: &HeaderMap,
    body: Body,
) -> Result<Submission, Problem> {
    let file = FormFile::read(headers, body, app.config.limits.min_upload_rate).await?;
    if file.name.is_empty() {
        return Err(Problem::new(
            ProblemKind::InvalidRequest,
            "no file was chosen; choose a bundle (.tar.gz, .tar.zst, .zip, or .tar of a container image)",
        ));
    }
    let incoming = IncomingBundle {
        claimed_name: file.name,
        key: None,
        source: BundleSource::Body {
            bytes: file.bytes,
            body: file.body,
        },
    };
    upload(app, &member.team, incoming).await
}

/// Stores the bundle and redirects to the dashboard, or shows the error there.
pub(super) async fn submit(
    member: PageMember,
    State(app): State<App>,
    spoilers: Spoilers,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, PageProblem> {
    session::check_same_origin(&headers)?;
    match receive_bundle(&app, &member, &headers, body).await {
        Ok(_) => Ok(redirect_done("/dashboard", "uploaded")),
        Err(problem) => {
            overview::page_with(&app, &member, &spoilers, Notice::Refused(&problem)).await
        }
    }
}
