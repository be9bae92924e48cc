//! What surrounds every request: id, log line, security headers, patience, and a net for panics.

use crate::{
    in_flight::{self, InFlight},
    peer::Peer,
};
use axum::{
    Router,
    body::Body,
    extract::{Request, State},
    http::{Extensions, HeaderMap, HeaderName, HeaderValue, StatusCode, Version, header},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};
use faceoff_pages::Embeddable;
use faceoff_service::{
    app::AppState,
    conditions::Conditions,
    kept_answers,
    problem::Problem,
    watched::{REQUEST_ID, watch},
};
use std::{any::Any, sync::Arc};
use tower_http::{
    catch_panic::CatchPanicLayer,
    compression::{
        CompressionLayer,
        predicate::{Predicate, SizeAbove},
    },
    request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer},
};

pub(crate) fn around(site: Router, app: &Arc<AppState>) -> Router {
    // The last layer is the outermost: the id exists before the log line, and a panic or a refusal
    // carries the security headers as well.
    let texts = SizeAbove::new(WORTH_COMPRESSING).and(is_text);
    site.layer(CatchPanicLayer::custom(panicked))
        .layer(CompressionLayer::new().compress_when(texts))
        .layer(middleware::from_fn_with_state(Arc::clone(app), keep))
        .layer(middleware::from_fn(revalidate))
        .layer(middleware::from_fn_with_state(
            InFlight::new(app),
            in_flight::limit,
        ))
        .layer(middleware::from_fn_with_state(Arc::clone(app), limit_rate))
        .layer(middleware::map_response(security_headers))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(middleware::from_fn_with_state(Arc::clone(app), watch))
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(middleware::map_request(drop_foreign_request_id))
}

/// Smaller answers gain nothing. (And what holds a secret is smaller: how far that is compressed could tell of it.)
const WORTH_COMPRESSING: u64 = 2048;

/// Archives are compressed already, streams of events are to come at once, and parts of files are parts of their bytes.
fn is_text(_: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    let media_type = headers.get(header::CONTENT_TYPE);
    let media_type = media_type.and_then(|value| value.to_str().ok());
    let essence = media_type.and_then(|value| value.split(';').next());
    let texts = [
        "application/json",
        "application/problem+json",
        "image/svg+xml",
        "text/css",
        "text/csv",
        "text/html",
        "text/javascript",
        "text/plain",
    ];
    essence.is_some_and(|essence| texts.contains(&essence.trim()))
}

/// Tells who has a board's page already that it still stands. Their condition goes no further, so that the page is made for
/// them as for everybody, once (`kept_answers.rs`).
async fn revalidate(mut request: Request, next: Next) -> Response {
    if !kept_answers::is_board_page(request.uri().path()) {
        return next.run(request).await;
    }
    let conditions = Conditions::taken_from(request.headers_mut());
    let response = next.run(request).await;
    let tag = response.headers().get(header::ETAG).cloned();
    match tag.filter(|_| response.status() == StatusCode::OK) {
        Some(tag) if conditions.have(&tag) => {
            let (mut parts, _) = response.into_parts();
            parts.status = StatusCode::NOT_MODIFIED;
            for of_body in [header::CONTENT_TYPE, header::CONTENT_LENGTH] {
                parts.headers.remove(of_body);
            }
            Response::from_parts(parts, Body::empty())
        }
        _ => response,
    }
}

/// Answers visitors from what is kept.
async fn keep(State(app): State<Arc<AppState>>, request: Request, next: Next) -> Response {
    let second = app.config.clock.now().as_second();
    match kept_answers::asked(&request, &app.store, second) {
        Some(asked) => app.kept_answers.get(asked, next.run(request)).await,
        None => next.run(request).await,
    }
}

/// Answers `TooManyRequests` to an address that asks too often.
async fn limit_rate(State(app): State<Arc<AppState>>, request: Request, next: Next) -> Response {
    let peer = request.extensions().get::<Peer>();
    let checked = match peer.and_then(|peer| peer.asks(request.headers())) {
        Some(address) => app.rates.check_address(address),
        None => Ok(()),
    };
    match checked {
        Ok(()) => next.run(request).await,
        Err(problem) => {
            app.config.metrics.web().refused("rate");
            faceoff_pages::for_whom(request.uri().path(), request.headers(), problem)
        }
    }
}

/// A request id comes from us alone: a foreign one could imitate another request's log lines.
async fn drop_foreign_request_id(mut request: Request) -> Request {
    request.headers_mut().remove(REQUEST_ID);
    request
}

/// What a page may load and do, and who may hold it.
macro_rules! policy {
    ($ancestors:literal) => {
        concat!(
            "default-src 'none'; style-src 'self'; script-src 'self'; connect-src 'self'; img-src 'self'; \
             base-uri 'none'; form-action 'self'; frame-ancestors ",
            $ancestors
        )
    };
}

async fn security_headers(mut response: Response) -> Response {
    let is_embeddable = response.extensions().get::<Embeddable>().is_some();
    let headers = response.headers_mut();
    if !is_embeddable {
        headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    }
    for (name, value) in [
        (
            header::CONTENT_SECURITY_POLICY,
            if is_embeddable {
                policy!("*")
            } else {
                policy!("'none'")
            },
        ),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
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
