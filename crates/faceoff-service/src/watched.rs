//! What is noted of every request: a line of the log, and the server's numbers.

use crate::{app::AppState, boxed};
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

/// What a request is for, as far as the log minds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Asked for again and again by what watches the server, and files that never change.
    Probe,
    Read,
    Change,
}

impl Kind {
    fn of(method: &Method, path: &str) -> Self {
        const PROBES: [&str; 5] = [
            "/livez",
            "/readyz",
            "/metrics",
            "/static/",
            "/api/v1/health",
        ];
        if PROBES.iter().any(|probe| path.starts_with(probe)) {
            Self::Probe
        } else if method.is_safe() {
            Self::Read
        } else {
            Self::Change
        }
    }

    /// How loud the log is of such a request with this answer.
    fn level(self, status: StatusCode) -> Level {
        match self {
            // A server that is not ready says so by 503, and has said in the log why.
            Self::Probe => Level::TRACE,
            // The cause of a failure was logged where it arose.
            _ if status.is_server_error() => Level::WARN,
            Self::Read => Level::DEBUG,
            Self::Change => Level::INFO,
        }
    }
}

/// Answers a request in a span of its own, which has its id and, once they are known, who asks.
#[boxed]
pub async fn watch(State(app): State<Arc<AppState>>, request: Request, next: Next) -> Response {
    let began = Instant::now();
    let (method, path) = (request.method().clone(), request.uri().path());
    let kind = Kind::of(&method, path);
    let span = span(&request);
    let route = request.extensions().get::<MatchedPath>().cloned();
    let response = next.run(request).instrument(span.clone()).await;
    let (took, status) = (began.elapsed(), response.status());
    let route = route.as_ref().map(MatchedPath::as_str);
    let web = app.config.metrics.web();
    web.answered(method.as_str(), route, status.as_u16(), took);
    span.in_scope(|| told(kind.level(status), status, took.as_secs_f64()));
    response
}

fn told(level: Level, status: StatusCode, took_s: f64) {
    let status = status.as_u16();
    // A line's level is part of its place in the program.
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
    // The query and the headers stay out of the log: they may hold names and tokens.
    let path = without_code(request.uri().path());
    let evaluation = evaluation(path);
    let method = request.method();
    tracing::info_span!("http", %method, path, id, evaluation, actor = field::Empty)
}

/// Says in the request's span who asks.
pub fn asked_by(actor: &faceoff_store::Actor) {
    Span::current().record("actor", field::display(actor));
}

/// The evaluation that a path names.
fn evaluation(path: &str) -> Option<&str> {
    let (_, rest) = path.split_once("/evaluations/")?;
    rest.split('/').next().filter(|id| !id.is_empty())
}

/// Who reads the log must not be able to follow an invitation.
fn without_code(path: &str) -> &str {
    const JOIN: &str = "/join/";
    match path.strip_prefix(JOIN) {
        Some(_) => JOIN,
        None => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_an_invitation_stays_out_of_the_log() {
        assert_eq!(without_code("/join/fo_invite_abc"), "/join/");
        assert_eq!(without_code("/api/v1/board"), "/api/v1/board");
    }

    #[test]
    fn the_evaluation_of_a_path_is_found() {
        assert_eq!(evaluation("/api/v1/evaluations/01a/dataset"), Some("01a"));
        assert_eq!(evaluation("/evaluations/01a"), Some("01a"));
        assert_eq!(evaluation("/api/v1/evaluations"), None);
        assert_eq!(evaluation("/api/v1/board"), None);
    }

    #[test]
    fn what_changes_something_is_told_of_and_what_is_asked_often_is_not() {
        let level = |method, path, status: u16| {
            let status = StatusCode::from_u16(status).unwrap();
            Kind::of(&method, path).level(status)
        };
        assert_eq!(level(Method::POST, "/api/v1/days", 201), Level::INFO);
        assert_eq!(level(Method::POST, "/api/v1/days", 409), Level::INFO);
        assert_eq!(level(Method::GET, "/api/v1/board", 200), Level::DEBUG);
        assert_eq!(level(Method::GET, "/api/v1/board", 500), Level::WARN);
        assert_eq!(level(Method::GET, "/readyz", 503), Level::TRACE);
        assert_eq!(level(Method::GET, "/api/v1/health/live", 200), Level::TRACE);
    }
}
