//! Uploading an agent.

use super::document::Binary;
use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{paths, views::submission::SubmissionView};
use faceoff_service::{
    acts::uploading::{Incoming, upload},
    app::App,
    auth::TeamCaller,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    views::submission,
};
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct UploadQuery {
    /// Name of the archive, e.g. `striker.tar.gz`; shown with the submission.
    file_name: Option<String>,
}

/// Another place for the archive's name, for clients that cannot set a query.
const FILE_NAME: HeaderName = HeaderName::from_static("x-file-name");

/// Media types that an archive may claim; none at all is fine too.
const ARCHIVE_TYPES: [&str; 8] = [
    "application/octet-stream",
    "application/gzip",
    "application/x-gzip",
    "application/x-gtar",
    "application/x-tar",
    "application/zstd",
    "application/zip",
    "application/x-zip-compressed",
];

/// Uploads a bundle: the request's body is the archive itself (.tar.gz, .tar.zst, .zip, or .tar of a container image).
///
/// It is unpacked and started in a smoke run; follow the submission until it is `valid` or `invalid`.
#[utoipa::path(
    post, path = "/submissions", tag = "team", security(("team" = [])),
    params(
        UploadQuery,
        ("X-File-Name" = Option<String>, Header, description = "another place for the archive's name", example = "striker.tar.gz"),
    ),
    request_body(
        description = "the archive itself",
        content(
            (inline(Binary) = "application/octet-stream"),
            (inline(Binary) = "application/gzip"),
            (inline(Binary) = "application/x-gzip"),
            (inline(Binary) = "application/x-gtar"),
            (inline(Binary) = "application/x-tar"),
            (inline(Binary) = "application/zstd"),
            (inline(Binary) = "application/zip"),
            (inline(Binary) = "application/x-zip-compressed"),
        )
    ),
    responses(
        (status = 201, body = SubmissionView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 408, description = "the body stalled, or came too slowly"),
        (status = 409, description = "the season is closed, or the team's storage is full"),
        (status = 413, description = "larger than max_bundle_bytes"),
        (status = 415, description = "not one of the archive formats"),
        (status = 429, description = "several uploads are under way or wait for their smoke run, or the day's quota is spent"),
        (status = 507, description = "the server's disk has too little room"),
    )
)]
pub(crate) async fn create_submission(
    caller: TeamCaller,
    State(app): State<App>,
    QueryParams(query): QueryParams<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Result<impl IntoResponse, Problem> {
    check_media_type(&headers)?;
    let claimed_name = query
        .file_name
        .or_else(|| Some(headers.get(FILE_NAME)?.to_str().ok()?.to_owned()))
        .unwrap_or_default();
    let announced = headers.get(header::CONTENT_LENGTH);
    let incoming = Incoming {
        bytes: announced.and_then(|value| value.to_str().ok()?.parse().ok()),
        claimed_name,
        body,
    };
    let submission = upload(&app, &caller, incoming).await?;
    let location = [(header::LOCATION, paths::submission(submission.id))];
    let now = app.config.clock.now();
    let view = submission::view(submission, None, &[], now);
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(value) = headers.get(header::CONTENT_TYPE) else {
        return Ok(());
    };
    let text = value.to_str().unwrap_or("(not text)");
    let essence = text
        .split(';')
        .next()
        .unwrap_or_default()
        .trim()
        .to_ascii_lowercase();
    if ARCHIVE_TYPES.contains(&essence.as_str()) {
        return Ok(());
    }
    Err(Problem::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "expected the archive itself as the body, with “Content-Type: application/octet-stream”; \
             got {text:?}. With curl: --data-binary @agent.tar.gz -H 'Content-Type: \
             application/octet-stream'"
        ),
    ))
}
