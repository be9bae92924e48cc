//! Content negotiation: the formats (page, JSON, CSV) and encodings (gzip) that a client accepts, between which responses choose.

use axum::http::{HeaderMap, HeaderName, header};

/// Whether the client wants a page rather than JSON, for example as the answer to an unknown path.
pub fn wants_page(headers: &HeaderMap) -> bool {
    headers
        .get(header::ACCEPT)
        .and_then(|accept| accept.to_str().ok())
        .is_some_and(|accept| accept.contains("text/html"))
}

/// Whether the client accepts CSV but not JSON.
pub fn wants_csv(headers: &HeaderMap) -> bool {
    let accepts = |media_type: &str| {
        elements(headers, header::ACCEPT).any(|accepted| {
            let name = accepted.split(';').next().unwrap_or(accepted);
            name.trim().eq_ignore_ascii_case(media_type)
        })
    };
    accepts("text/csv") && !accepts("application/json")
}

/// Whether the client accepts gzip, whatever its preference.
pub fn accepts_gzip(headers: &HeaderMap) -> bool {
    let (mut named, mut any) = (None, false);
    for encoding in elements(headers, header::ACCEPT_ENCODING) {
        let (name, weight) = encoding.split_once(';').unwrap_or((encoding, ""));
        let refused = weight
            .trim()
            .strip_prefix("q=")
            .is_some_and(|weight| weight.trim().parse() == Ok(0.0));
        match name.trim() {
            "*" => any = !refused,
            name if ["gzip", "x-gzip"]
                .iter()
                .any(|gzip| name.eq_ignore_ascii_case(gzip)) =>
            {
                named = Some(!refused);
            }
            _ => {}
        }
    }
    // An encoding that is named is not meant by `*`.
    named.unwrap_or(any)
}

/// The elements of a header's list, over all its values.
fn elements(headers: &HeaderMap, name: HeaderName) -> impl Iterator<Item = &str> {
    let values = headers.get_all(name).into_iter();
    values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    fn with(name: HeaderName, value: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_static(value))])
    }

    #[test]
    fn gzip_is_sent_if_accepted() {
        let accepts = |value| accepts_gzip(&with(header::ACCEPT_ENCODING, value));
        assert!(accepts("deflate, gzip;q=0.5"));
        assert!(accepts("br,*"));
        assert!(accepts("GZIP"));
        assert!(!accepts("gzip;q=0, *"));
        assert!(!accepts("br, gzip;q=0"));
        assert!(!accepts("identity"));
        assert!(!accepts_gzip(&HeaderMap::new()));
    }

    #[test]
    fn csv_is_sent_if_json_is_not_accepted() {
        let wants = |value| wants_csv(&with(header::ACCEPT, value));
        assert!(wants("Text/CSV; charset=utf-8"));
        assert!(!wants("text/csv, application/json;q=0.1"));
        assert!(!wants("*/*"));
    }
}
