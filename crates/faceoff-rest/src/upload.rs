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
    services::{
        partial_uploads::parse_hash,
        uploads::{BundleSource, IncomingBundle, upload},
    },
    views::submission,
};
use faceoff_types::{IdempotencyKey, InvalidIdempotencyKey};
use serde::Deserialize;
use utoipa::IntoParams;

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct UploadQuery {
    /// File name of the bundle, e.g. `striker.tar.gz`; shown with the submission.
    file_name: Option<String>,
    /// Takes the bundle with this BLAKE3 hash that was uploaded in parts (PATCH /api/v1/uploads/HASH). The request then has no body.
    upload: Option<String>,
}

/// Header with the bundle's file name, for clients that cannot set a query.
const FILE_NAME: HeaderName = HeaderName::from_static("x-file-name");

/// Header with which an upload can be sent again without creating a second submission.
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

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
///
/// With a header `Idempotency-Key` the request can be sent again after a broken connection: a second upload of the same bundle with the
/// same key returns the submission of the first one.
#[utoipa::path(
    post, path = "/submissions", tag = "team", security(("team" = [])),
    params(
        UploadQuery,
        ("X-File-Name" = Option<String>, Header, description = "file name of the bundle, as an alternative to the query parameter", example = "striker.tar.gz"),
        ("Idempotency-Key" = Option<String>, Header, description = "1 to 100 visible ASCII characters that the client has chosen for this upload", example = "7f0c4a7e-3f5e-4c1b-9d7e-0a5f5f1d2c3b"),
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
        (status = 404, description = "no part of the bundle has arrived"),
        (status = 409, description = "the season is closed, the team's storage is full, or parts of the bundle are missing"),
        (status = 413, description = "larger than `max_bundle_bytes`"),
        (status = 415, description = "not a supported bundle format"),
        (status = 422, description = "the key was used for another bundle"),
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
    let claimed_name = query
        .file_name
        .or_else(|| Some(headers.get(FILE_NAME)?.to_str().ok()?.to_owned()))
        .unwrap_or_default();
    let source = match query.upload {
        Some(hash) => BundleSource::Parts(parse_hash(&hash)?),
        None => {
            check_media_type(&headers)?;
            let content_length = headers.get(header::CONTENT_LENGTH);
            BundleSource::Body {
                bytes: content_length.and_then(|value| value.to_str().ok()?.parse().ok()),
                body,
            }
        }
    };
    let incoming = IncomingBundle {
        claimed_name,
        key: idempotency_key(&headers)?,
        source,
    };
    let submission = upload(&app, &caller, incoming).await?;
    let location = [(header::LOCATION, paths::submission(submission.id))];
    let now = app.config.clock.now();
    let view = submission::view(submission, None, &[], now);
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<IdempotencyKey>, Problem> {
    let Some(value) = headers.get(IDEMPOTENCY_KEY) else {
        return Ok(None);
    };
    let parsed = String::from_utf8_lossy(value.as_bytes()).parse();
    parsed.map(Some).map_err(|error: InvalidIdempotencyKey| {
        Problem::new(
            ProblemKind::InvalidRequest,
            format!("the header Idempotency-Key: {error}"),
        )
    })
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(value) = headers.get(header::CONTENT_TYPE) else {
        return Ok(());
    };
    let text = value.to_str().unwrap_or("(not text)");
    // Without parameters such as `charset`.
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
