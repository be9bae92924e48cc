//! Cached public responses, valid until the season changes and for one second at most. Without it, many visitors of a board
//! would take CPU time from the agents that run on the same machine.

use crate::{content_negotiation, problem::Problem, shared_cache::SharedCache};
use axum::{
    body::{self, Body, Bytes},
    extract::Request,
    http::{Extensions, HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_api::paths::API_BASE;
use faceoff_store::Store;
use std::sync::Arc;

/// Size of the cache in bytes; a board of a hundred teams has some ten kilobytes.
const MAX_BYTES: u64 = 32 << 20;
/// Longer keys are not cached: visitors could fill the memory with them.
const MAX_KEY_BYTES: usize = 1024;
/// Largest response; every page and board is smaller.
const MAX_RESPONSE_BYTES: usize = 64 << 20;

/// Paths of public pages.
const PAGES: [&str; 5] = [
    "/",
    "/season",
    "/announcements",
    "/feed.atom",
    "/tournaments",
];
const PAGE_PREFIXES: [&str; 3] = ["/tasks/", "/teams/", "/tournaments/"];
/// Paths of public API resources.
const RESOURCES: [&str; 4] = ["/board", "/season", "/stages", "/announcements"];
const RESOURCE_PREFIXES: [&str; 2] = ["/board/", "/stages/"];

/// Request headers that may change the response. A request with one of them is not answered from the cache.
const PERSONAL_HEADERS: [HeaderName; 7] = [
    header::AUTHORIZATION,
    header::COOKIE,
    header::IF_NONE_MATCH,
    header::IF_MODIFIED_SINCE,
    header::IF_MATCH,
    header::IF_UNMODIFIED_SINCE,
    header::RANGE,
];

/// Everything that a public response depends on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct AnswerKey {
    uri: String,
    /// What the client accepts, as far as responses differ by it: any other spelling of the headers has the same response.
    wants_page: bool,
    wants_csv: bool,
    accepts_gzip: bool,
    /// Number of changes of the season so far.
    changes: u64,
    /// The current time as a Unix timestamp: some responses depend on it.
    second: i64,
}

/// A response in memory.
#[derive(Debug, Clone)]
pub struct CachedResponse {
    status: StatusCode,
    headers: HeaderMap,
    body: Bytes,
    /// Values that the handler attached to the response for the layers around it, such as that of the security headers.
    extensions: Extensions,
}

impl CachedResponse {
    async fn read(response: Response) -> Self {
        let (parts, body) = response.into_parts();
        match body::to_bytes(body, MAX_RESPONSE_BYTES).await {
            Ok(body) => Self {
                status: parts.status,
                headers: parts.headers,
                body,
                extensions: parts.extensions,
            },
            Err(error) => {
                let problem = Problem::internal(format_args!("reading a response: {error}"));
                let (parts, _) = problem.into_response().into_parts();
                Self {
                    status: parts.status,
                    headers: parts.headers,
                    body: Bytes::new(),
                    extensions: parts.extensions,
                }
            }
        }
    }

    fn bytes(&self) -> usize {
        // The second summand is an allowance for headers and key.
        self.body.len() + 4 * MAX_KEY_BYTES
    }
}

impl IntoResponse for CachedResponse {
    fn into_response(self) -> Response {
        let mut response = Response::new(Body::from(self.body));
        *response.status_mut() = self.status;
        *response.headers_mut() = self.headers;
        *response.extensions_mut() = self.extensions;
        response
    }
}

/// Cache of public responses.
pub type AnswerCache = SharedCache<AnswerKey, CachedResponse>;

pub(crate) fn new() -> AnswerCache {
    SharedCache::with_bytes(MAX_BYTES, CachedResponse::bytes)
}

/// The cached response, or the result of `compute`. Concurrent requests share one computation. Only responses with status 200
/// are cached.
pub async fn get(
    cache: &AnswerCache,
    key: AnswerKey,
    compute: impl Future<Output = Response> + Send,
) -> Response {
    let computed = async {
        let response = Arc::new(CachedResponse::read(compute.await).await);
        match response.status {
            StatusCode::OK => Ok(response),
            _ => Err(response),
        }
    };
    let (Ok(response) | Err(response)) = cache.get(key, computed).await;
    CachedResponse::clone(&response).into_response()
}

/// The key of a request's response; `None` if the response depends on the caller. `second` is the current time as a Unix
/// timestamp. The request's `Accept-Encoding` is replaced by what the key says of it, so that the encoder cannot read it
/// differently.
pub fn cache_key(request: &mut Request, store: &Store, second: i64) -> Option<AnswerKey> {
    let headers = request.headers();
    let is_public = request.method() == Method::GET
        && is_public_path(request.uri().path())
        && !PERSONAL_HEADERS
            .iter()
            .any(|name| headers.contains_key(name));
    let uri = request.uri().to_string();
    if !is_public || uri.len() > MAX_KEY_BYTES {
        return None;
    }
    let key = AnswerKey {
        uri,
        wants_page: content_negotiation::wants_page(headers),
        wants_csv: content_negotiation::wants_csv(headers),
        accepts_gzip: content_negotiation::accepts_gzip(headers),
        changes: store.change_count(),
        second,
    };
    let headers = request.headers_mut();
    headers.remove(header::ACCEPT_ENCODING);
    if key.accepts_gzip {
        headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static("gzip"));
    }
    Some(key)
}

/// Whether a path is a board's page. For these pages the server checks `If-None-Match` before it uses this cache.
pub fn is_board_page(path: &str) -> bool {
    path == "/" || path.starts_with("/tasks/")
}

fn is_public_path(path: &str) -> bool {
    let is_one_of = |path: &str, exact: &[&str], prefixes: &[&str]| {
        exact.contains(&path) || prefixes.iter().any(|prefix| path.starts_with(prefix))
    };
    match path.strip_prefix(API_BASE) {
        Some(resource) => is_one_of(resource, &RESOURCES, &RESOURCE_PREFIXES),
        None => is_one_of(path, &PAGES, &PAGE_PREFIXES),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn requests_share_a_response_unless_they_accept_others() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        let key = |headers: &[(HeaderName, &'static str)]| {
            let mut request = Request::new(Body::empty());
            for (name, value) in headers {
                request
                    .headers_mut()
                    .append(name, HeaderValue::from_static(value));
            }
            let key = cache_key(&mut request, &store, 0).unwrap();
            let encoding = request.headers().get(header::ACCEPT_ENCODING).cloned();
            (key, encoding)
        };
        let (accept, encoding) = (header::ACCEPT, header::ACCEPT_ENCODING);
        let plain = key(&[]);
        assert_eq!(plain.1, None);
        let spellings = ["*/*", "image/*", "image/*;q=0.123", "x/y"];
        for spelling in spellings {
            assert_eq!(key(&[(accept.clone(), spelling)]), plain);
            assert_eq!(key(&[(encoding.clone(), spelling)]), plain);
        }
        let compressed = key(&[(encoding.clone(), "gzip")]);
        assert_eq!(compressed.1.as_ref().unwrap(), "gzip");
        assert_eq!(key(&[(encoding.clone(), "br, gzip;q=0.1")]), compressed);
        let others = [
            plain,
            compressed,
            key(&[(accept.clone(), "text/html,*/*")]),
            key(&[(accept, "text/csv")]),
        ];
        for (index, other) in others.iter().enumerate() {
            assert!(!others[..index].contains(other), "{other:?}");
        }
    }

    #[test]
    fn personal_paths_are_not_cached() {
        for path in ["/", "/tasks/hit", "/api/v1/board", "/api/v1/board/hit"] {
            assert!(is_public_path(path), "{path}");
        }
        for path in [
            "/account",
            "/metrics",
            "/api/v1/me",
            "/api/v1/boards",
            "/tasks",
        ] {
            assert!(!is_public_path(path), "{path}");
        }
    }
}
