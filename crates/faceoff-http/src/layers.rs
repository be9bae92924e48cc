//! What surrounds every request: id, log line, security headers, patience, and a net for panics.

use crate::problem::{Problem, ProblemKind};
use axum::{
    Router,
    extract::{Request, State},
    http::{HeaderName, HeaderValue, header},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};
use std::{any::Any, sync::Arc, time::Duration};
use tokio::sync::Semaphore;
use tower_http::{
    catch_panic::CatchPanicLayer,
    request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer},
    trace::{DefaultOnResponse, TraceLayer},
};
use tracing::{Level, Span};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Wraps the site. `in_flight` bounds the requests being answered at the same time.
pub(crate) fn around(site: Router, in_flight: usize) -> Router {
    // The last layer is the outermost: the id exists before the log line, and a panic or a refusal
    // carries the security headers as well.
    site.layer(CatchPanicLayer::custom(panicked))
        .layer(middleware::from_fn_with_state(
            Arc::new(Semaphore::new(in_flight)),
            limit_in_flight,
        ))
        .layer(middleware::map_response(security_headers))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(
            TraceLayer::new_for_http()
                .make_span_with(span)
                .on_response(DefaultOnResponse::new().level(Level::INFO))
                // A 5xx answer was logged with its cause where it arose.
                .on_failure(()),
        )
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(middleware::map_request(drop_foreign_request_id))
}

/// Answers `Busy` when a handler takes longer than `patience`.
pub(crate) async fn time_out(
    State(patience): State<Duration>,
    request: Request,
    next: Next,
) -> Response {
    match tokio::time::timeout(patience, next.run(request)).await {
        Ok(response) => response,
        Err(_) => Problem::new(
            ProblemKind::Busy,
            format!(
                "the answer took longer than {} s; try again later",
                patience.as_secs_f64()
            ),
        )
        .into_response(),
    }
}

async fn limit_in_flight(
    State(slots): State<Arc<Semaphore>>,
    request: Request,
    next: Next,
) -> Response {
    match slots.try_acquire() {
        Ok(_slot) => next.run(request).await,
        Err(_) => Problem::new(
            ProblemKind::Busy,
            "the server answers as many requests as it may at once; try again in 2 s",
        )
        .into_response(),
    }
}

/// A request id comes from us alone: a foreign one could imitate another request's log lines.
async fn drop_foreign_request_id(mut request: Request) -> Request {
    request.headers_mut().remove(REQUEST_ID);
    request
}

fn span(request: &Request) -> Span {
    let id = request
        .headers()
        .get(REQUEST_ID)
        .and_then(|id| id.to_str().ok())
        .unwrap_or_default();
    // The query and the headers stay out of the log: they may hold names and tokens.
    let path = without_code(request.uri().path());
    tracing::info_span!("http", method = %request.method(), path, id)
}

/// Who reads the log must not be able to follow an invitation.
fn without_code(path: &str) -> &str {
    const JOIN: &str = "/join/";
    match path.strip_prefix(JOIN) {
        Some(_) => JOIN,
        None => path,
    }
}

async fn security_headers(mut response: Response) -> Response {
    let headers = response.headers_mut();
    for (name, value) in [
        (
            header::CONTENT_SECURITY_POLICY,
            "default-src 'none'; style-src 'self'; img-src 'self'; base-uri 'none'; \
             form-action 'self'; frame-ancestors 'none'",
        ),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::REFERRER_POLICY, "no-referrer"),
        (
            HeaderName::from_static("cross-origin-opener-policy"),
            "same-origin",
        ),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // Scores change and API answers belong to their caller; only the hashed assets say otherwise.
    headers
        .entry(header::CACHE_CONTROL)
        .or_insert(HeaderValue::from_static("no-store"));
    response
}

fn panicked(panic: Box<dyn Any + Send + 'static>) -> Response {
    let message = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    Problem::internal(format_args!("a handler panicked: {message}")).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_an_invitation_stays_out_of_the_log() {
        assert_eq!(without_code("/join/fo_invite_abc"), "/join/");
        assert_eq!(without_code("/api/v1/board"), "/api/v1/board");
    }
}
