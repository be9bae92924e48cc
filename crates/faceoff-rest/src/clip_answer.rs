//! A clip as an answer: once, and compressed for who takes it.

use super::downloads::stays_its_callers;
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

/// Sends what `clip` reads, unless the client has it by its tag.
pub(super) async fn send(
    tag: &ETag,
    conditions: &Conditions,
    headers: &HeaderMap,
    clip: impl Future<Output = Result<Vec<u8>, Problem>>,
) -> Result<Response, Problem> {
    if let Some(mut answer) = conditions.not_modified(tag) {
        stays_its_callers(answer.headers_mut());
        return Ok(answer);
    }
    let compressed = clip.await?;
    let mut answer = if accepts_gzip(headers) {
        let encoding = (header::CONTENT_ENCODING, "gzip");
        ([encoding], Body::from(compressed)).into_response()
    } else {
        let mut bytes = Vec::new();
        GzDecoder::new(compressed.as_slice())
            .read_to_end(&mut bytes)
            .map_err(Problem::internal)?;
        Body::from(bytes).into_response()
    };
    let sent = answer.headers_mut();
    sent.insert(header::ETAG, tag.header());
    sent.insert(
        header::CONTENT_TYPE,
        HeaderValue::from_static("application/octet-stream"),
    );
    stays_its_callers(sent);
    let by = HeaderValue::from_static("authorization, cookie, accept-encoding");
    sent.insert(header::VARY, by);
    Ok(answer)
}

/// Does the client take gzip? By the encodings that it names, whichever it likes best.
fn accepts_gzip(headers: &HeaderMap) -> bool {
    let named = headers.get_all(header::ACCEPT_ENCODING).iter();
    named
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|one| {
            let (name, weight) = one.split_once(';').unwrap_or((one, ""));
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
    fn gzip_is_sent_to_who_takes_it() {
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
