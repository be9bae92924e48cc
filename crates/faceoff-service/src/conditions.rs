//! On what a request makes its answer depend: the tag of what its client has, and which bytes it wants.

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, HeaderValue, Method, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use http_range_header::{RangeUnsatisfiableError, parse_range_header};
use std::{convert::Infallible, ops::Range};

/// The same as long as the answer is. Nothing in it has a meaning in a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ETag {
    /// With its quotation marks.
    opaque: String,
    /// It is not of every byte: the answer may be compressed.
    is_weak: bool,
}

impl ETag {
    /// Of the bytes that have this BLAKE3 hash.
    pub fn of_bytes(blake3: &str) -> Self {
        Self {
            opaque: format!("\"blake3-{blake3}\""),
            is_weak: false,
        }
    }

    /// Of the bytes of a file that never changes.
    pub fn of_file(key: &str, bytes: u64) -> Self {
        Self {
            is_weak: false,
            ..Self::of("file", &[key, &bytes.to_string()])
        }
    }

    /// Of an answer that follows from all of these, and from nothing else.
    pub fn of(what: &str, from: &[&str]) -> Self {
        let mut hasher = blake3::Hasher::new();
        for part in from {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
        Self {
            opaque: format!("\"{what}-{}\"", hasher.finalize()),
            is_weak: true,
        }
    }

    /// As the header `ETag` has it.
    pub fn header(&self) -> HeaderValue {
        let weak = if self.is_weak { "W/" } else { "" };
        let text = format!("{weak}{}", self.opaque);
        HeaderValue::try_from(text).expect("names and hexadecimal digits")
    }
}

/// What a client says of the answer that it wants.
#[derive(Debug)]
pub struct Conditions {
    is_get: bool,
    headers: HeaderMap,
}

/// Which bytes are to be sent.
#[derive(Debug, PartialEq, Eq)]
pub enum Wanted {
    All,
    Some(Range<u64>),
    /// A range that begins behind the end.
    Nothing,
}

impl<S: Sync> FromRequestParts<S> for Conditions {
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

impl Conditions {
    /// Is a body asked for, and not its headers alone?
    pub const fn is_get(&self) -> bool {
        self.is_get
    }

    /// Takes from a request what its client has.
    pub fn taken_from(headers: &mut HeaderMap) -> Self {
        let mut taken = HeaderMap::new();
        if let header::Entry::Occupied(values) = headers.entry(header::IF_NONE_MATCH) {
            let (name, values) = values.remove_entry_mult();
            for value in values {
                taken.append(&name, value);
            }
        }
        Self {
            is_get: true,
            headers: taken,
        }
    }

    /// Has the client what has this tag, as a header tells it?
    pub fn have(&self, tag: &HeaderValue) -> bool {
        let tag = tag.to_str().unwrap_or_default();
        let tag = tag.strip_prefix("W/").unwrap_or(tag);
        let known = self.headers.get_all(header::IF_NONE_MATCH).into_iter();
        // A weak comparison, as the header's is; a comma within a tag makes parts that are none of ours.
        known
            .filter_map(|value| value.to_str().ok())
            .flat_map(|value| value.split(','))
            .map(|known| known.trim())
            .map(|known| known.strip_prefix("W/").unwrap_or(known))
            .any(|known| known == "*" || known == tag)
    }

    /// The answer to who has it already.
    pub fn not_modified(&self, tag: &ETag) -> Option<Response> {
        self.have(&tag.header()).then(|| {
            let headers = [(header::ETAG, tag.header())];
            (StatusCode::NOT_MODIFIED, headers).into_response()
        })
    }

    /// Which of so many bytes of what has this tag. Several ranges are answered with everything, which every client has to
    /// understand; so is a range that is none.
    pub fn wanted(&self, tag: &ETag, bytes: u64) -> Wanted {
        // There is no range of what is not sent.
        let Some(range) = self.headers.get(header::RANGE).filter(|_| self.is_get) else {
            return Wanted::All;
        };
        // Another file cannot be continued. (A date is none that we have told.)
        let goes_on = self.headers.get(header::IF_RANGE);
        if goes_on.is_some_and(|known| tag.is_weak || known.as_bytes() != tag.opaque.as_bytes()) {
            return Wanted::All;
        }
        let Ok(Ok(ranges)) = range.to_str().map(parse_range_header) else {
            return Wanted::All;
        };
        match ranges.validate(bytes).as_deref() {
            Ok([one]) => Wanted::Some(*one.start()..*one.end() + 1),
            Err(RangeUnsatisfiableError::Unsatisfiable) => Wanted::Nothing,
            Ok(_) | Err(_) => Wanted::All,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(headers: &[(header::HeaderName, &str)]) -> Conditions {
        let headers = headers
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_str(value).unwrap()));
        Conditions {
            is_get: true,
            headers: headers.collect(),
        }
    }

    #[test]
    fn a_range_is_of_the_bytes_that_there_are() {
        let tag = ETag::of_bytes("00");
        for (range, wanted) in [
            ("bytes=0-0", Wanted::Some(0..1)),
            ("bytes=2-5", Wanted::Some(2..6)),
            ("bytes=7-", Wanted::Some(7..10)),
            ("bytes=7-99", Wanted::Some(7..10)),
            ("bytes=-3", Wanted::Some(7..10)),
            ("bytes=-99", Wanted::Some(0..10)),
            ("bytes=10-", Wanted::Nothing),
            ("bytes=10-12", Wanted::Nothing),
            ("bytes=-0", Wanted::Nothing),
            // Several, and what is none at all.
            ("bytes=0-1,4-5", Wanted::All),
            ("bytes=5-2", Wanted::All),
            ("bytes=a-b", Wanted::All),
            ("bytes=", Wanted::All),
            ("lines=1-2", Wanted::All),
            ("bytes=-1-2", Wanted::All),
        ] {
            let asked = asked(&[(header::RANGE, range)]);
            assert_eq!(asked.wanted(&tag, 10), wanted, "{range}");
        }
        let of_nothing = asked(&[(header::RANGE, "bytes=0-")]);
        assert_eq!(of_nothing.wanted(&tag, 0), Wanted::Nothing);
    }

    #[test]
    fn a_range_goes_on_only_in_the_same_file() {
        let tag = ETag::of_bytes("00");
        for (known, wanted) in [
            ("\"blake3-00\"", Wanted::Some(5..10)),
            ("\"blake3-01\"", Wanted::All),
            ("W/\"blake3-00\"", Wanted::All),
            ("Wed, 21 Oct 2015 07:28:00 GMT", Wanted::All),
        ] {
            let asked = asked(&[(header::RANGE, "bytes=5-"), (header::IF_RANGE, known)]);
            assert_eq!(asked.wanted(&tag, 10), wanted, "{known}");
        }
    }

    #[test]
    fn who_has_it_is_told_so() {
        let tag = ETag::of_bytes("00");
        for (known, has_it) in [
            ("\"blake3-00\"", true),
            ("W/\"blake3-00\"", true),
            ("\"a\", \"blake3-00\"", true),
            ("*", true),
            ("\"blake3-01\"", false),
            ("blake3-00", false),
        ] {
            let asked = asked(&[(header::IF_NONE_MATCH, known)]);
            assert_eq!(asked.not_modified(&tag).is_some(), has_it, "{known}");
        }
    }

    #[test]
    fn parts_of_a_tag_do_not_run_together() {
        assert_ne!(ETag::of("a", &["b", "c"]), ETag::of("a", &["bc", ""]));
    }
}
