//! Downloads of stored files (artifacts): whole files, byte ranges, and headers only.

use axum::{
    body::Body,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    app::App,
    problem::{Problem, ProblemKind},
    request_preconditions::{ByteRange, ETag, RequestPreconditions},
};
use faceoff_store::StoreError;

/// BLAKE3 of the whole file, 64 hexadecimal digits. (RFC 9530 has no name for this hash.)
pub(super) const CONTENT_BLAKE3: HeaderName = HeaderName::from_static("x-content-blake3");

/// An artifact to send, with its metadata.
#[derive(Debug, Clone, Copy)]
pub(super) struct Download<'a> {
    /// Key of the artifact in the store.
    pub(super) key: &'a str,
    /// BLAKE3 hash of the file, if it is known.
    pub(super) blake3: Option<&'a str>,
    pub(super) media_type: &'static str,
    /// File name for the client; must be valid in a header.
    pub(super) name: &'a str,
}

/// Sends a file, or the requested range of it.
///
/// # Errors
/// [`StoreError::NotFound`] if there is no artifact with this key.
pub(super) async fn download(
    app: &App,
    conditions: &RequestPreconditions,
    file: Download<'_>,
) -> Result<Response, StoreError> {
    let Download { key, blake3, .. } = file;
    let artifacts = app.store.artifacts();
    let bytes = artifacts.size_bytes(key).await?;
    let bytes = bytes.ok_or(StoreError::NotFound("artifact"))?;
    // A key is never reused for another file.
    let tag = blake3.map_or_else(|| ETag::for_file(key, bytes), ETag::from_hash);
    if let Some(mut response) = conditions.not_modified(&tag) {
        set_private_caching(response.headers_mut());
        return Ok(response);
    }
    let (status, range) = match conditions.byte_range(&tag, bytes) {
        ByteRange::Full => (StatusCode::OK, 0..bytes),
        ByteRange::Partial(part) => (StatusCode::PARTIAL_CONTENT, part),
        ByteRange::Unsatisfiable => return range_not_satisfiable(bytes),
    };
    let body = match status {
        _ if !conditions.is_get() => Body::empty(),
        StatusCode::OK => Body::from_stream(artifacts.read(key).await?.1),
        _ => Body::from_stream(artifacts.read_range(key, range.clone()).await?),
    };
    let mut response = (status, body).into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_LENGTH, (range.end - range.start).into());
    headers.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static(file.media_type),
    );
    let disposition = format!("attachment; filename=\"{}\"", file.name);
    headers.insert(header::CONTENT_DISPOSITION, header_value(&disposition)?);
    headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    headers.insert(header::ETAG, tag.header());
    if let Some(blake3) = blake3 {
        headers.insert(CONTENT_BLAKE3, header_value(blake3)?);
    }
    if status == StatusCode::PARTIAL_CONTENT {
        let content_range = format!("bytes {}-{}/{bytes}", range.start, range.end - 1);
        headers.insert(header::CONTENT_RANGE, header_value(&content_range)?);
    }
    set_private_caching(headers);
    Ok(response)
}

/// Sends a response with this tag, unless the client already has it. `response` is awaited only if needed.
pub(super) async fn send_tagged(
    tag: &ETag,
    conditions: &RequestPreconditions,
    response: impl Future<Output = Result<Response, Problem>>,
) -> Result<Response, Problem> {
    let mut response = match conditions.not_modified(tag) {
        Some(not_modified) => not_modified,
        None => response.await?,
    };
    let headers = response.headers_mut();
    headers.insert(header::ETAG, tag.header());
    set_private_caching(headers);
    Ok(response)
}

/// Lets only the caller's own cache store the response, and makes it revalidate each time.
pub(super) fn set_private_caching(headers: &mut HeaderMap) {
    let cache = HeaderValue::from_static("private, no-cache");
    headers.insert(header::CACHE_CONTROL, cache);
    let request_headers = HeaderValue::from_static("authorization, cookie");
    headers.insert(header::VARY, request_headers);
}

fn range_not_satisfiable(bytes: u64) -> Result<Response, StoreError> {
    let range = header_value(&format!("bytes */{bytes}"))?;
    let problem = Problem::new(
        ProblemKind::RangeNotSatisfiable,
        format!("expected a range within {bytes} bytes, got one that begins behind the end"),
    )
    .with("bytes", bytes)
    .with_header(header::CONTENT_RANGE, range);
    Ok(problem.into_response())
}

fn header_value(text: &str) -> Result<HeaderValue, StoreError> {
    HeaderValue::try_from(text)
        .map_err(|error| StoreError::Artifacts(format!("{text:?} in a header: {error}")))
}

/// A name with letters, digits and hyphens only, for headers and file systems.
pub(super) fn file_stem(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
