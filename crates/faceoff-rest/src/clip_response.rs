//! Responses with a clip, which is the data of one episode, or of a part of a game, for the replay viewer. The response is
//! compressed if the client accepts gzip, and 304 if the client already has the clip.

use super::downloads::set_private_caching;
use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    content_negotiation::accepts_gzip,
    problem::Problem,
    request_preconditions::{ETag, RequestPreconditions},
};
use flate2::read::GzDecoder;
use std::io::Read;

/// Sends the clip, unless the client already has the one with this tag. `clip` is gzip-compressed, and awaited only if needed.
pub(super) async fn send(
    tag: &ETag,
    conditions: &RequestPreconditions,
    headers: &HeaderMap,
    clip: impl Future<Output = Result<Vec<u8>, Problem>>,
) -> Result<Response, Problem> {
    if let Some(mut response) = conditions.not_modified(tag) {
        set_private_caching(response.headers_mut());
        return Ok(response);
    }
    let compressed = clip.await?;
    let mut response = if accepts_gzip(headers) {
        let encoding = (header::CONTENT_ENCODING, "gzip");
        ([encoding], Body::from(compressed)).into_response()
    } else {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed.as_slice())
            .read_to_end(&mut bytes)
            .map_err(Problem::internal)?;
        Body::from(bytes).into_response()
    };
    let response_headers = response.headers_mut();
    response_headers.insert(header::ETAG, tag.header());
    response_headers.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static("application/octet-stream"),
    );
    set_private_caching(response_headers);
    let request_headers = HeaderValue::from_static("authorization, cookie, accept-encoding");
    response_headers.insert(header::VARY, request_headers);
    Ok(response)
}
