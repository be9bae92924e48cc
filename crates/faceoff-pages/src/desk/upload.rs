//! `/desk/upload`: an agent from a form, streamed to disk as the API's are.

use super::agents;
use crate::{
    desk_frame::{Said, done},
    form_file::FormFile,
    frame::PageProblem,
    signed_in::Member,
};
use axum::{body::Body, extract::State, http::HeaderMap, response::Response};
use faceoff_service::{
    acts::uploading::{Incoming, upload},
    app::App,
    problem::{Problem, ProblemKind},
    session,
};
use faceoff_store::Submission;

async fn taken(
    app: &App,
    member: &Member,
    headers: &HeaderMap,
    body: Body,
) -> Result<Submission, Problem> {
    let file = FormFile::of(headers, body, app.config.limits.upload_rate).await?;
    if file.name.is_empty() {
        return Err(Problem::new(
            ProblemKind::InvalidRequest,
            "no file was chosen; choose the agent's archive (.tar.gz, .tar.zst, .zip, or .tar of a container image)",
        ));
    }
    let incoming = Incoming {
        bytes: file.bytes,
        claimed_name: file.name,
        body: file.body,
    };
    upload(app, &member.team, incoming).await
}

/// Takes the agent in and leads to the desk, or says there what was wrong with it.
pub(super) async fn submit(
    member: Member,
    State(app): State<App>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, PageProblem> {
    session::check_own_page(&headers)?;
    match taken(&app, &member, &headers, body).await {
        Ok(_) => Ok(done("/desk", "uploaded")),
        Err(problem) => agents::page_with(&app, &member, Said::Refused(&problem)).await,
    }
}
