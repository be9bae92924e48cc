//! Logging and metrics of HTTP requests.

use crate::{app::AppState, boxed_future};
use axum::{
    extract::{MatchedPath, Request, State},
    http::{HeaderName, Method, StatusCode},
    middleware::Next,
    response::Response,
};
use std::{sync::Arc, time::Instant};
use tracing::{Instrument as _, Level, Span, field};

/// The header with the request's id.
pub const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// The kind of a request, which decides its log level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RequestKind {
    /// Polled by monitoring, or a static file.
    Routine,
    /// Changes nothing (GET, HEAD, OPTIONS).
    Read,
    Change,
}

impl RequestKind {
    /// The kind of a request with this method and path.
    fn new(method: &Method, path: &str) -> Self {
        /// Beginnings of the paths of routine requests.
        const ROUTINE_PATHS: [&str; 5] = [
            "/livez",
            "/readyz",
            "/metrics",
            "/static/",
            "/api/v1/health",
        ];
        if ROUTINE_PATHS.iter().any(|start| path.starts_with(start)) {
            Self::Routine
        } else if method.is_safe() {
            Self::Read
        } else {
            Self::Change
        }
    }

    /// Log level of a request of this kind whose response has this status.
    fn level(self, status: StatusCode) -> Level {
        match self {
            // A server that is not ready responds with 503 and has logged the reason.
            Self::Routine => Level::TRACE,
            // The cause of a failure is logged where it occurs.
            _ if status.is_server_error() => Level::WARN,
            Self::Read => Level::DEBUG,
            Self::Change => Level::INFO,
        }
    }
}

/// Handles a request in a span with its id and, once it is authenticated, its actor.
#[boxed_future]
pub async fn log_request(
    State(app): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    let started_at = Instant::now();
    let (method, path) = (request.method().clone(), request.uri().path());
    let kind = RequestKind::new(&method, path);
    let span = span(&request);
    let route = request.extensions().get::<MatchedPath>().cloned();
    let response = next.run(request).instrument(span.clone()).await;
    let (duration, status) = (started_at.elapsed(), response.status());
    let route = route.as_ref().map(MatchedPath::as_str);
    let web = app.config.metrics.web();
    web.record_response(method.as_str(), route, status.as_u16(), duration);
    span.in_scope(|| log_response(kind.level(status), status, duration.as_secs_f64()));
    response
}

fn log_response(level: Level, status: StatusCode, took_s: f64) {
    let status = status.as_u16();
    // The macros need a constant level.
    match level {
        Level::WARN => tracing::warn!(status, took_s, "answered"),
        Level::INFO => tracing::info!(status, took_s, "answered"),
        Level::DEBUG => tracing::debug!(status, took_s, "answered"),
        _ => tracing::trace!(status, took_s, "answered"),
    }
}

fn span(request: &Request) -> Span {
    let id = request
        .headers()
        .get(REQUEST_ID)
        .and_then(|id| id.to_str().ok())
        .unwrap_or_default();
    // Query and headers stay out of the log: they may contain names and tokens.
    let path = redact_code(request.uri().path());
    let evaluation = evaluation_id(path);
    let method = request.method();
    tracing::info_span!("http", %method, path, id, evaluation, actor = field::Empty)
}

/// Records the caller in the request's span.
pub fn record_actor(actor: &faceoff_store::Actor) {
    Span::current().record("actor", field::display(actor));
}

/// The id of the evaluation in a path.
fn evaluation_id(path: &str) -> Option<&str> {
    let (_, rest) = path.split_once("/evaluations/")?;
    rest.split('/').next().filter(|id| !id.is_empty())
}

/// Removes an invitation's code: a reader of the log must not be able to accept it.
fn redact_code(path: &str) -> &str {
    const PREFIX: &str = "/join/";
    match path.strip_prefix(PREFIX) {
        Some(_) => PREFIX,
        None => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invitation_code_is_not_logged() {
        assert_eq!(redact_code("/join/fo_invite_abc"), "/join/");
        assert_eq!(redact_code("/api/v1/board"), "/api/v1/board");
    }

    #[test]
    fn evaluation_is_found_in_path() {
        assert_eq!(
            evaluation_id("/api/v1/evaluations/01a/dataset"),
            Some("01a")
        );
        assert_eq!(evaluation_id("/evaluations/01a"), Some("01a"));
        assert_eq!(evaluation_id("/api/v1/evaluations"), None);
        assert_eq!(evaluation_id("/api/v1/board"), None);
    }

    #[test]
    fn log_level_depends_on_kind_and_status() {
        let level = |method, path, status: u16| {
            let status = StatusCode::from_u16(status).unwrap();
            RequestKind::new(&method, path).level(status)
        };
        assert_eq!(level(Method::POST, "/api/v1/days", 201), Level::INFO);
        assert_eq!(level(Method::POST, "/api/v1/days", 409), Level::INFO);
        assert_eq!(level(Method::GET, "/api/v1/board", 200), Level::DEBUG);
        assert_eq!(level(Method::GET, "/api/v1/board", 500), Level::WARN);
        assert_eq!(level(Method::GET, "/readyz", 503), Level::TRACE);
        assert_eq!(level(Method::GET, "/api/v1/health/live", 200), Level::TRACE);
    }
}
