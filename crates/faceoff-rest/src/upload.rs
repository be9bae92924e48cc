//! Uploading submissions. The uploaded file is the *bundle*: an archive with the agent, or a container image.

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
    app::App,
    auth::TeamCaller,
    extract::QueryParams,
    problem::{Problem, ProblemKind},
    services::uploads::{IncomingBundle, upload},
    views::submission,
};
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct UploadQuery {
    /// File name of the bundle, e.g. `striker.tar.gz`; shown with the submission.
    file_name: Option<String>,
}

/// Header with the bundle's file name, for clients that cannot set a query.
const FILE_NAME: HeaderName = HeaderName::from_static("x-file-name");

/// Accepted media types of bundles; the header may also be left out.
const BUNDLE_TYPES: [&str; 8] = [
    "application/octet-stream",
    "application/gzip",
    "application/x-gzip",
    "application/x-gtar",
    "application/x-tar",
    "application/zstd",
    "application/zip",
    "application/x-zip-compressed",
];

/// Uploads a bundle. The request body is the bundle itself (.tar.gz, .tar.zst, .zip, or .tar of a container image).
///
/// It is unpacked and checked in a validation run; poll the submission until its state is `valid` or `invalid`.
#[utoipa::path(
    post, path = "/submissions", tag = "team", security(("team" = [])),
    params(
        UploadQuery,
        ("X-File-Name" = Option<String>, Header, description = "file name of the bundle, as an alternative to the query parameter", example = "striker.tar.gz"),
    ),
    request_body(
        description = "the bundle itself",
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
        (status = 201, body = SubmissionView, headers(("Location" = String, description = "path of the submission"))),
        (status = 408, description = "the upload stalled, or was too slow"),
        (status = 409, description = "the season is closed, or the team's storage is full"),
        (status = 413, description = "larger than `max_bundle_bytes`"),
        (status = 415, description = "not a supported bundle format"),
        (status = 429, description = "too many uploads are running, too many submissions wait for their validation run, or the daily quota is used up"),
        (status = 507, description = "the server's disk has too little free space"),
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
    let content_length = headers.get(header::CONTENT_LENGTH);
    let incoming = IncomingBundle {
        bytes: content_length.and_then(|value| value.to_str().ok()?.parse().ok()),
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
    // Without parameters.
    let media_type = text
        .split(';')
        .next()
        .unwrap_or_default()
        .trim()
        .to_ascii_lowercase();
    if BUNDLE_TYPES.contains(&media_type.as_str()) {
        return Ok(());
    }
    Err(Problem::new(
        ProblemKind::UnsupportedMediaType,
        format!(
            "expected the bundle itself as the body, with “Content-Type: application/octet-stream”, got {text:?}. With \
             curl: --data-binary @agent.tar.gz -H 'Content-Type: application/octet-stream'"
        ),
    ))
}
