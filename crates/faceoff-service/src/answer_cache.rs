//! Cached public responses, valid until the season changes and for one second at most. Without it, many visitors of a board
//! would take CPU time from the agents that run on the same machine.

use crate::{problem::Problem, shared_cache::SharedCache};
use axum::{
    body::{self, Body, Bytes},
    extract::Request,
    http::{HeaderMap, HeaderName, Method, StatusCode, header},
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
    /// Values of the headers `Accept` and `Accept-Encoding`.
    accept: Option<Vec<u8>>,
    accept_encoding: Option<Vec<u8>>,
    /// Number of changes of the season so far.
    changes: u64,
    /// The current time as a Unix timestamp: some responses depend on it.
    second: i64,
}

impl AnswerKey {
    fn length(&self) -> usize {
        let length = |value: &Option<Vec<u8>>| value.as_ref().map_or(0, Vec::len);
        self.uri.len() + length(&self.accept) + length(&self.accept_encoding)
    }
}

/// A response in memory.
#[derive(Debug, Clone)]
pub struct CachedResponse {
    status: StatusCode,
    headers: HeaderMap,
    body: Bytes,
}

impl CachedResponse {
    async fn read(response: Response) -> Self {
        let (parts, body) = response.into_parts();
        match body::to_bytes(body, MAX_RESPONSE_BYTES).await {
            Ok(body) => Self {
                status: parts.status,
                headers: parts.headers,
                body,
            },
            Err(error) => {
                let problem = Problem::internal(format_args!("reading a response: {error}"));
                let (parts, _) = problem.into_response().into_parts();
                Self {
                    status: parts.status,
                    headers: parts.headers,
                    body: Bytes::new(),
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
    compute: impl Future<Output = Response>,
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
/// timestamp.
pub fn cache_key(request: &Request, store: &Store, second: i64) -> Option<AnswerKey> {
    let headers = request.headers();
    let is_public = request.method() == Method::GET
        && is_public_path(request.uri().path())
        && !PERSONAL_HEADERS
            .iter()
            .any(|name| headers.contains_key(name));
    let header_bytes = |name| headers.get(name).map(|value| value.as_bytes().to_vec());
    if !is_public {
        return None;
    }
    let key = AnswerKey {
        uri: request.uri().to_string(),
        accept: header_bytes(header::ACCEPT),
        accept_encoding: header_bytes(header::ACCEPT_ENCODING),
        changes: store.change_count(),
        second,
    };
    (key.length() <= MAX_KEY_BYTES).then_some(key)
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
