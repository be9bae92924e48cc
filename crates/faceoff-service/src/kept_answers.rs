//! What every visitor gets alike, kept while nothing changes, for a second at most: how many people look at a board must
//! not be felt by those whose agents play.

use crate::problem::Problem;
use axum::{
    body::{self, Body, Bytes},
    extract::Request,
    http::{HeaderMap, HeaderName, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use faceoff_api::paths::API_BASE;
use faceoff_store::Store;
use moka::future::Cache;
use std::time::Duration;

/// Bytes of answers that are kept; a board of a hundred teams has some ten thousand.
const KEPT_BYTES: u64 = 32 << 20;
/// What asks for more words than this is not kept: strangers could fill the memory with them.
const LONGEST_QUESTION: usize = 1024;
/// So long at most; what is asked has the second in it.
const KEPT_FOR: Duration = Duration::from_secs(2);
/// No page and no board is as large as this.
const LARGEST_BYTES: usize = 64 << 20;

/// Pages that anybody may see, by their paths; below the last ones, too.
const PAGES: [&str; 5] = [
    "/",
    "/season",
    "/announcements",
    "/feed.atom",
    "/tournaments",
];
const BELOW: [&str; 3] = ["/tasks/", "/teams/", "/tournaments/"];
/// Likewise of the API.
const RESOURCES: [&str; 4] = ["/board", "/season", "/stages", "/announcements"];
const RESOURCES_BELOW: [&str; 2] = ["/board/", "/stages/"];

/// Whoever sends one of these may get another answer than others.
const OF_ONES_OWN: [HeaderName; 7] = [
    header::AUTHORIZATION,
    header::COOKIE,
    header::IF_NONE_MATCH,
    header::IF_MODIFIED_SINCE,
    header::IF_MATCH,
    header::IF_UNMODIFIED_SINCE,
    header::RANGE,
];

/// What an answer depends on.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Asked {
    what: String,
    accepts: Option<Vec<u8>>,
    encodings: Option<Vec<u8>>,
    /// How often the season had been changed.
    changes: u64,
    /// Some of it depends on the time.
    second: i64,
}

impl Asked {
    fn length(&self) -> usize {
        let length = |words: &Option<Vec<u8>>| words.as_ref().map_or(0, Vec::len);
        self.what.len() + length(&self.accepts) + length(&self.encodings)
    }
}

/// An answer in memory.
#[derive(Debug, Clone)]
struct Answer {
    status: StatusCode,
    headers: HeaderMap,
    body: Bytes,
}

impl Answer {
    async fn of(response: Response) -> Self {
        let (parts, body) = response.into_parts();
        match body::to_bytes(body, LARGEST_BYTES).await {
            Ok(body) => Self {
                status: parts.status,
                headers: parts.headers,
                body,
            },
            Err(error) => {
                let problem = Problem::internal(format_args!("an answer in memory: {error}"));
                let (parts, _) = problem.into_response().into_parts();
                Self {
                    status: parts.status,
                    headers: parts.headers,
                    body: Bytes::new(),
                }
            }
        }
    }

    fn bytes(&self) -> u32 {
        // The rest is for the headers and what is asked, which is bounded.
        u32::try_from(self.body.len() + 4 * LONGEST_QUESTION).unwrap_or(u32::MAX)
    }
}

impl IntoResponse for Answer {
    fn into_response(self) -> Response {
        let mut response = Response::new(Body::from(self.body));
        *response.status_mut() = self.status;
        *response.headers_mut() = self.headers;
        response
    }
}

/// The answers that are kept.
#[derive(Debug)]
pub struct KeptAnswers(Cache<Asked, Answer>);

impl KeptAnswers {
    /// What is kept, or what `make` makes: once, however many ask for it meanwhile. Refusals are not kept.
    pub async fn get(&self, asked: Asked, make: impl Future<Output = Response>) -> Response {
        let made = self.0.try_get_with(asked, async {
            let answer = Answer::of(make.await).await;
            match answer.status {
                StatusCode::OK => Ok(answer),
                _ => Err(answer),
            }
        });
        match made.await {
            Ok(answer) => answer.into_response(),
            Err(other) => Answer::clone(&other).into_response(),
        }
    }
}

impl Default for KeptAnswers {
    fn default() -> Self {
        let cache = Cache::builder()
            .max_capacity(KEPT_BYTES)
            .time_to_live(KEPT_FOR)
            .weigher(|_, answer: &Answer| answer.bytes());
        Self(cache.build())
    }
}

/// What is asked, if everybody gets the same for it.
pub fn asked(request: &Request, store: &Store, second: i64) -> Option<Asked> {
    let headers = request.headers();
    let is_for_all = request.method() == Method::GET
        && is_everybodys(request.uri().path())
        && !OF_ONES_OWN.iter().any(|name| headers.contains_key(name));
    let value = |name| headers.get(name).map(|value| value.as_bytes().to_vec());
    if !is_for_all {
        return None;
    }
    let asked = Asked {
        what: request.uri().to_string(),
        accepts: value(header::ACCEPT),
        encodings: value(header::ACCEPT_ENCODING),
        changes: store.changes_made(),
        second,
    };
    (asked.length() <= LONGEST_QUESTION).then_some(asked)
}

/// Has a path a board's page, whose conditions are looked at before it is asked for?
pub fn is_board_page(path: &str) -> bool {
    path == "/" || path.starts_with("/tasks/")
}

fn is_everybodys(path: &str) -> bool {
    let is_one_of = |path: &str, exact: &[&str], below: &[&str]| {
        exact.contains(&path) || below.iter().any(|folder| path.starts_with(folder))
    };
    match path.strip_prefix(API_BASE) {
        Some(resource) => is_one_of(resource, &RESOURCES, &RESOURCES_BELOW),
        None => is_one_of(path, &PAGES, &BELOW),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_somebody_may_see_otherwise_is_not_kept() {
        for path in ["/", "/tasks/hit", "/api/v1/board", "/api/v1/board/hit"] {
            assert!(is_everybodys(path), "{path}");
        }
        for path in [
            "/account",
            "/metrics",
            "/api/v1/me",
            "/api/v1/boards",
            "/tasks",
        ] {
            assert!(!is_everybodys(path), "{path}");
        }
    }
}
