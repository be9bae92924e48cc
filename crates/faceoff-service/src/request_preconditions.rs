//! Conditional and range requests (RFC 9110): the headers `If-None-Match`, `If-Range` and `Range`. A client sends the entity
//! tag of the response that it already has, so that the server sends only what has changed or is missing.

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use http_range_header::{RangeUnsatisfiableError, parse_range_header};
use std::{convert::Infallible, ops::Range};

/// An entity tag: stays the same as long as the response does. It contains no comma or other character that separates values
/// in a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ETag {
    /// The tag without the prefix `W/`, with quotation marks.
    opaque: String,
    /// A weak tag does not identify every byte: the response may be compressed.
    is_weak: bool,
}

impl ETag {
    /// Tag of content with this BLAKE3 hash.
    pub fn from_hash(blake3: &str) -> Self {
        Self {
            opaque: format!("\"blake3-{blake3}\""),
            is_weak: false,
        }
    }

    /// Tag of a file that never changes, from its artifact key and its size.
    pub fn for_file(key: &str, bytes: u64) -> Self {
        Self {
            is_weak: false,
            ..Self::new("file", &[key, &bytes.to_string()])
        }
    }

    /// Tag of a response that is a function of these `parts`; `kind` distinguishes kinds of responses.
    pub fn new(kind: &str, parts: &[&str]) -> Self {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
        Self {
            opaque: format!("\"{kind}-{}\"", hasher.finalize()),
            is_weak: true,
        }
    }

    /// Value of the header `ETag`.
    pub fn header(&self) -> HeaderValue {
        let weak = if self.is_weak { "W/" } else { "" };
        let text = format!("{weak}{}", self.opaque);
        HeaderValue::try_from(text).expect("a tag has only printable ASCII characters")
    }
}

/// The conditions of a request.
#[derive(Debug)]
pub struct RequestPreconditions {
    is_get: bool,
    headers: HeaderMap,
}

/// The part of a file that the response contains.
#[derive(Debug, PartialEq, Eq)]
pub enum ByteRange {
    Full,
    Partial(Range<u64>),
    /// The range begins behind the end of the file.
    Unsatisfiable,
}

impl<S: Sync> FromRequestParts<S> for RequestPreconditions {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let mut headers = HeaderMap::new();
        for name in [header::IF_NONE_MATCH, header::IF_RANGE, header::RANGE] {
            for value in parts.headers.get_all(&name) {
                headers.append(&name, value.clone());
            }
        }
        Ok(Self {
            is_get: parts.method != Method::HEAD,
            headers,
        })
    }
}

impl RequestPreconditions {
    /// Whether the response has a body: it has none if the method is HEAD.
    pub const fn is_get(&self) -> bool {
        self.is_get
    }

    /// Moves `If-None-Match` from a request's headers into the conditions.
    pub fn take_from(headers: &mut HeaderMap) -> Self {
        let mut removed = HeaderMap::new();
        if let header::Entry::Occupied(values) = headers.entry(header::IF_NONE_MATCH) {
            let (name, values) = values.remove_entry_mult();
            for value in values {
                removed.append(&name, value);
            }
        }
        Self {
            is_get: true,
            headers: removed,
        }
    }

    /// Whether the client already has the response with this tag.
    pub fn matches(&self, tag: &HeaderValue) -> bool {
        let tag = tag.to_str().unwrap_or_default();
        let tag = tag.strip_prefix("W/").unwrap_or(tag);
        let values = self.headers.get_all(header::IF_NONE_MATCH).into_iter();
        // A weak comparison, as RFC 9110 requires. An `ETag` contains no comma, so splitting at commas is safe.
        values
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(','))
            .map(|client_tag| client_tag.trim())
            .map(|client_tag| client_tag.strip_prefix("W/").unwrap_or(client_tag))
            .any(|client_tag| client_tag == "*" || client_tag == tag)
    }

    /// The response 304, if the client already has the response with this tag.
    pub fn not_modified(&self, tag: &ETag) -> Option<Response> {
        self.matches(&tag.header()).then(|| {
            let headers = [(header::ETAG, tag.header())];
            (StatusCode::NOT_MODIFIED, headers).into_response()
        })
    }

    /// The requested range of a file of `bytes` bytes. Several ranges and malformed ones give the whole file, which every
    /// client has to accept.
    pub fn byte_range(&self, tag: &ETag, bytes: u64) -> ByteRange {
        // A response to HEAD has no range.
        let Some(range) = self.headers.get(header::RANGE).filter(|_| self.is_get) else {
            return ByteRange::Full;
        };
        // The client has a part of another file. (`If-Range` may also be a date; no response has a date, so none matches.)
        let if_range = self.headers.get(header::IF_RANGE);
        if if_range
            .is_some_and(|client_tag| tag.is_weak || client_tag.as_bytes() != tag.opaque.as_bytes())
        {
            return ByteRange::Full;
        }
        let Ok(Ok(ranges)) = range.to_str().map(parse_range_header) else {
            return ByteRange::Full;
        };
        match ranges.validate(bytes).as_deref() {
            Ok([range]) => ByteRange::Partial(*range.start()..*range.end() + 1),
            Err(RangeUnsatisfiableError::Unsatisfiable) => ByteRange::Unsatisfiable,
            Ok(_) | Err(_) => ByteRange::Full,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Length of the requested file in bytes.
    const FILE_BYTES: u64 = 10;
    const HASH: &str = "00";

    fn conditions(headers: &[(header::HeaderName, &str)]) -> RequestPreconditions {
        let headers = headers
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_str(value).unwrap()));
        RequestPreconditions {
            is_get: true,
            headers: headers.collect(),
        }
    }

    #[test]
    fn range_is_limited_to_file_length() {
        let tag = ETag::from_hash(HASH);
        for (range, expected) in [
            ("bytes=0-0", ByteRange::Partial(0..1)),
            ("bytes=2-5", ByteRange::Partial(2..6)),
            ("bytes=7-", ByteRange::Partial(7..10)),
            ("bytes=7-99", ByteRange::Partial(7..10)),
            ("bytes=-3", ByteRange::Partial(7..10)),
            ("bytes=-99", ByteRange::Partial(0..10)),
            ("bytes=10-", ByteRange::Unsatisfiable),
            ("bytes=10-12", ByteRange::Unsatisfiable),
            ("bytes=-0", ByteRange::Unsatisfiable),
            // Several ranges, and malformed ones.
            ("bytes=0-1,4-5", ByteRange::Full),
            ("bytes=5-2", ByteRange::Full),
            ("bytes=a-b", ByteRange::Full),
            ("bytes=", ByteRange::Full),
            ("lines=1-2", ByteRange::Full),
            ("bytes=-1-2", ByteRange::Full),
        ] {
            let request = conditions(&[(header::RANGE, range)]);
            assert_eq!(request.byte_range(&tag, FILE_BYTES), expected, "{range}");
        }
        let empty_file = conditions(&[(header::RANGE, "bytes=0-")]);
        assert_eq!(empty_file.byte_range(&tag, 0), ByteRange::Unsatisfiable);
    }

    #[test]
    fn range_continues_only_the_same_file() {
        let tag = ETag::from_hash(HASH);
        for (if_range, expected) in [
            ("\"blake3-00\"", ByteRange::Partial(5..10)),
            ("\"blake3-01\"", ByteRange::Full),
            ("W/\"blake3-00\"", ByteRange::Full),
            ("Wed, 21 Oct 2015 07:28:00 GMT", ByteRange::Full),
        ] {
            let request = conditions(&[(header::RANGE, "bytes=5-"), (header::IF_RANGE, if_range)]);
            assert_eq!(request.byte_range(&tag, FILE_BYTES), expected, "{if_range}");
        }
    }

    #[test]
    fn matching_tag_gives_not_modified() {
        let tag = ETag::from_hash(HASH);
        for (if_none_match, matches) in [
            ("\"blake3-00\"", true),
            ("W/\"blake3-00\"", true),
            ("\"a\", \"blake3-00\"", true),
            ("*", true),
            ("\"blake3-01\"", false),
            ("blake3-00", false),
        ] {
            let request = conditions(&[(header::IF_NONE_MATCH, if_none_match)]);
            assert_eq!(
                request.not_modified(&tag).is_some(),
                matches,
                "{if_none_match}"
            );
        }
    }

    #[test]
    fn tag_distinguishes_boundaries_of_parts() {
        assert_ne!(ETag::new("a", &["b", "c"]), ETag::new("a", &["bc", ""]));
    }
}
