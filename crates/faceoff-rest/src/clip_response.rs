//! Responses with a clip, which is the data of one episode, or of a part of a game, for the replay viewer. The response is
//! compressed if the client accepts gzip, and 304 if the client already has the clip.

use super::downloads::set_private_caching;
use axum::{
    body::Body,
    http::{HeaderMap, HeaderValue, header},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    conditions::{Conditions, ETag},
    problem::Problem,
};
use flate2::read::GzDecoder;
use std::io::Read;

/// Sends the clip, unless the client already has the one with this tag. `clip` is gzip-compressed, and awaited only if needed.
pub(super) async fn send(
    tag: &ETag,
    conditions: &Conditions,
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

/// Whether the client accepts gzip, whatever its preference.
fn accepts_gzip(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::ACCEPT_ENCODING).iter();
    values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|encoding| {
            let (name, weight) = encoding.split_once(';').unwrap_or((encoding, ""));
            let refused = weight
                .trim()
                .strip_prefix("q=")
                .is_some_and(|weight| weight.trim().parse() == Ok(0.0));
            matches!(name.trim(), "gzip" | "x-gzip" | "*") && !refused
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gzip_is_sent_if_accepted() {
        let accepts = |text: &'static str| {
            let value = HeaderValue::from_static(text);
            accepts_gzip(&HeaderMap::from_iter([(header::ACCEPT_ENCODING, value)]))
        };
        assert!(accepts("deflate, gzip;q=0.5"));
        assert!(accepts("br,*"));
        assert!(!accepts("br, gzip;q=0"));
        assert!(!accepts("identity"));
        assert!(!accepts_gzip(&HeaderMap::new()));
    }
}
