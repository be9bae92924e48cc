//! Files as they are sent: whole, in part, or as what is known of them.

use axum::{
    body::Body,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    app::App,
    conditions::{Conditions, ETag, Wanted},
    problem::{Problem, ProblemKind},
};
use faceoff_store::StoreError;

/// BLAKE3 of the whole file, 64 hexadecimal digits. (RFC 9530 has no name for this hash.)
pub(super) const CONTENT_BLAKE3: HeaderName = HeaderName::from_static("x-content-blake3");

/// An artifact, and as what it is sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Download<'a> {
    pub(super) key: &'a str,
    /// Of the file, if it is known.
    pub(super) blake3: Option<&'a str>,
    pub(super) media_type: &'static str,
    /// What it is to be stored as; nothing that a header could trip over.
    pub(super) name: &'a str,
}

/// Answers with a file, or as much of it as is wanted.
///
/// # Errors
/// [`StoreError::NotFound`] if there is none of this key.
pub(super) async fn download(
    app: &App,
    conditions: &Conditions,
    file: Download<'_>,
) -> Result<Response, StoreError> {
    let Download { key, blake3, .. } = file;
    let artifacts = app.store.artifacts();
    let bytes = artifacts.bytes_of(key).await?;
    let bytes = bytes.ok_or(StoreError::NotFound("artifact"))?;
    // No other file is ever stored under its key.
    let tag = blake3.map_or_else(|| ETag::of_file(key, bytes), ETag::of_bytes);
    if let Some(mut answer) = conditions.not_modified(&tag) {
        stays_its_callers(answer.headers_mut());
        return Ok(answer);
    }
    let (status, sent) = match conditions.wanted(&tag, bytes) {
        Wanted::All => (StatusCode::OK, 0..bytes),
        Wanted::Some(range) => (StatusCode::PARTIAL_CONTENT, range),
        Wanted::Nothing => return behind_the_end(bytes),
    };
    let body = match status {
        _ if !conditions.is_get() => Body::empty(),
        StatusCode::OK => Body::from_stream(artifacts.read(key).await?.1),
        _ => Body::from_stream(artifacts.read_range(key, sent.clone()).await?),
    };
    let mut answer = (status, body).into_response();
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_LENGTH, (sent.end - sent.start).into());
    headers.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static(file.media_type),
    );
    let disposition = format!("attachment; filename=\"{}\"", file.name);
    headers.insert(header::CONTENT_DISPOSITION, value(&disposition)?);
    headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    headers.insert(header::ETAG, tag.header());
    if let Some(blake3) = blake3 {
        headers.insert(CONTENT_BLAKE3, value(blake3)?);
    }
    if status == StatusCode::PARTIAL_CONTENT {
        let range = format!("bytes {}-{}/{bytes}", sent.start, sent.end - 1);
        headers.insert(header::CONTENT_RANGE, value(&range)?);
    }
    stays_its_callers(headers);
    Ok(answer)
}

/// Whoever keeps it asks each time, as who they are, whether it is still theirs to have.
pub(super) fn stays_its_callers(headers: &mut HeaderMap) {
    let cache = HeaderValue::from_static("private, no-cache");
    headers.insert(header::CACHE_CONTROL, cache);
    let by = HeaderValue::from_static("authorization, cookie");
    headers.insert(header::VARY, by);
}

fn behind_the_end(bytes: u64) -> Result<Response, StoreError> {
    let range = value(&format!("bytes */{bytes}"))?;
    let problem = Problem::new(
        ProblemKind::RangeNotSatisfiable,
        format!("the file has {bytes} bytes, and the range that was asked for begins behind them"),
    )
    .with("bytes", bytes)
    .with_header(header::CONTENT_RANGE, range);
    Ok(problem.into_response())
}

fn value(text: &str) -> Result<HeaderValue, StoreError> {
    HeaderValue::try_from(text)
        .map_err(|error| StoreError::Artifacts(format!("{text:?} in a header: {error}")))
}

/// A file name without anything that a header or a file system could trip over.
pub(super) fn plain(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
