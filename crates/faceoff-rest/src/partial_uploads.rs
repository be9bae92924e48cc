//! Uploads in parts, for large bundles and weak connections. A *partial upload* is a bundle of which the first bytes have arrived. Its
//! parts are sent in order, and the last one is followed by `POST /submissions?upload=HASH`.

use super::document::Binary;
use axum::{
    Json,
    body::Body,
    extract::State,
    http::{HeaderMap, HeaderName, StatusCode},
};
use faceoff_api::views::partial_upload::PartialUploadView;
use faceoff_service::{
    app::App,
    auth::TeamCaller,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    services::partial_uploads::{self, IncomingPart, parse_hash},
};

/// Header with the number of bytes before a part.
const UPLOAD_OFFSET: HeaderName = HeaderName::from_static("upload-offset");

/// Header with the size of the whole bundle in bytes.
const UPLOAD_LENGTH: HeaderName = HeaderName::from_static("upload-length");

/// Returns how much of a bundle has arrived.
#[utoipa::path(
    get, path = "/uploads/{blake3}", tag = "team", security(("team" = [])),
    params(("blake3" = String, Path, description = "BLAKE3 hash of the whole bundle, 64 hexadecimal digits")),
    responses(
        (status = 200, body = PartialUploadView),
        (status = 400, description = "not a BLAKE3 hash"),
        (status = 404, description = "no part of it has arrived, or none within the last day"),
    )
)]
pub(crate) async fn partial_upload(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(hash): PathParam<String>,
) -> Result<Json<PartialUploadView>, Problem> {
    let hash = parse_hash(&hash)?;
    let received_bytes = partial_uploads::received_bytes(&app, caller.team.id, hash).await?;
    Ok(Json(view(hash, received_bytes)))
}

/// Adds a part to a bundle: the bytes that follow those that have arrived.
///
/// If the connection breaks, what has arrived of the part is kept; `GET` says how much, and the next part begins there. An upload to
/// which nothing was added for a day is removed, and so is a team's oldest one if it begins more than it may send at the same time.
#[utoipa::path(
    patch, path = "/uploads/{blake3}", tag = "team", security(("team" = [])),
    params(
        ("blake3" = String, Path, description = "BLAKE3 hash of the whole bundle, 64 hexadecimal digits"),
        ("Upload-Offset" = u64, Header, description = "number of bytes before this part"),
        ("Upload-Length" = u64, Header, description = "size of the whole bundle in bytes"),
    ),
    request_body(description = "the bytes", content((inline(Binary) = "application/octet-stream"))),
    responses(
        (status = 200, body = PartialUploadView),
        (status = 400, description = "not a BLAKE3 hash, a header is missing, or the part is longer than the bundle"),
        (status = 408, description = "the upload stalled, or was too slow; what has arrived is kept"),
        (status = 409, description = "the part does not follow what has arrived (`received_bytes`), a newer connection has taken the upload over, the season is closed, or the team's storage is full"),
        (status = 413, description = "larger than `max_bundle_bytes`"),
        (status = 415, description = "not a supported bundle format"),
        (status = 429, description = "too many uploads are running, too many submissions wait for their validation run, or the daily quota is used up"),
        (status = 507, description = "the server's disk has too little free space"),
    )
)]
pub(crate) async fn add_part(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(hash): PathParam<String>,
    headers: HeaderMap,
    body: Body,
) -> Result<Json<PartialUploadView>, Problem> {
    let hash = parse_hash(&hash)?;
    let part = IncomingPart {
        bundle_blake3: hash,
        bundle_bytes: number(
            &headers,
            &UPLOAD_LENGTH,
            "the size of the whole bundle in bytes",
        )?,
        offset: number(
            &headers,
            &UPLOAD_OFFSET,
            "the number of bytes before this part",
        )?,
        body,
    };
    let received_bytes = partial_uploads::receive_part(&app, &caller, part).await?;
    Ok(Json(view(hash, received_bytes)))
}

/// Removes what has arrived of a bundle.
#[utoipa::path(
    delete, path = "/uploads/{blake3}", tag = "team", security(("team" = [])),
    params(("blake3" = String, Path, description = "BLAKE3 hash of the whole bundle, 64 hexadecimal digits")),
    responses(
        (status = 204),
        (status = 400, description = "not a BLAKE3 hash"),
        (status = 404, description = "no part of it has arrived"),
    ),
)]
pub(crate) async fn remove_upload(
    caller: TeamCaller,
    State(app): State<App>,
    PathParam(hash): PathParam<String>,
) -> Result<StatusCode, Problem> {
    partial_uploads::remove(&app, caller.team.id, parse_hash(&hash)?).await?;
    Ok(StatusCode::NO_CONTENT)
}

fn number(headers: &HeaderMap, name: &HeaderName, meaning: &str) -> Result<u64, Problem> {
    let value = headers.get(name);
    let number = value.and_then(|value| value.to_str().ok()?.trim().parse().ok());
    number.ok_or_else(|| {
        let got = value.map_or_else(
            || "nothing".to_owned(),
            |value| format!("{:?}", String::from_utf8_lossy(value.as_bytes())),
        );
        Problem::new(
            ProblemKind::InvalidRequest,
            format!("expected a header {name} with {meaning}, got {got}"),
        )
    })
}

fn view(hash: blake3::Hash, received_bytes: u64) -> PartialUploadView {
    PartialUploadView {
        blake3: hash.to_string(),
        received_bytes,
    }
}
